"""An emulated IRC5 controller with an IRB 140: the RAPID server's TCP ports and EGM, in real time."""

import select
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import Self

from robot_drivers.abb.emulator.arm import CYCLE_S, Arm, Motion
from robot_drivers.abb.emulator.clock import ControllerClock
from robot_drivers.abb.emulator.egm import GENERATIONS
from robot_drivers.abb.emulator.egm_session import EgmSession
from robot_drivers.abb.emulator.guidance import Guidance, GuidanceSettings
from robot_drivers.abb.emulator.orders import Orders
from robot_drivers.abb.emulator.ports import CommandPort, ServerPort
from robot_drivers.abb.emulator.rapid import RapidServer
from robot_drivers.abb.emulator.settings import ControllerFaults, EmulatorSettings
from robot_drivers.clock import host_time_ns, host_time_s, seconds_until
from robot_drivers.closing import ClosedAtExit
from robot_drivers.errors import ConfigurationError, MotionRefusedError
from robot_drivers.protocols import Pose

_CYCLE_NS = round(CYCLE_S * 1e9)
_MOST_CYCLES_A_TURN = 25
_REMEMBERED_CYCLES = 2048
_JOG_SPEED = (0.05, 0.5)  # m/s, rad/s


class ControllerEmulator(ClosedAtExit):
    """One controller, alive from :meth:`start` to :meth:`close` or within a ``with`` block.

    A single thread runs the cycle of 4.032 ms: requests, motion, replies, EGM, state stream. The methods may
    be called from any other thread and return when the cycle has taken notice.
    """

    def __init__(self, settings: EmulatorSettings | None = None) -> None:
        self._settings = settings or EmulatorSettings()
        self._arm = Arm(self._settings.arm)
        self._path = deque([(host_time_ns(), self._arm.actual)], maxlen=_REMEMBERED_CYCLES)
        self._rapid = RapidServer(self._settings, self._arm)
        self._command = CommandPort(self._settings.bind_address, self._settings.command_port)
        self._state = ServerPort(self._settings.bind_address, self._settings.state_port)
        self._egm = EgmSession(self._arm, self._settings.arm.seed)
        self._state_number = 0
        self._clock = ControllerClock()
        self._injected_s = host_time_s()
        self._restart_due = True
        self._held_back: list[bytes] = []
        self._orders = Orders()
        self._stopping = False
        self._thread = threading.Thread(target=self._run, name="abb-emulator", daemon=True)

    @property
    def command_port(self) -> int:
        """TCP port of the command server."""
        return self._command.port

    @property
    def state_port(self) -> int:
        """TCP port of the state stream."""
        return self._state.port

    def pose(self) -> Pose:
        """Return where the tool truly is now, ``T_base_tool``; cheap, from any thread."""
        return self._arm.actual

    def path(self) -> Sequence[tuple[int, Pose]]:
        """Return host time, ns, and :meth:`pose` of the newest cycles, oldest first; cheap, from any thread."""
        return self._path.copy()

    @property
    def behind_s(self) -> float:
        """How late its newest cycle is, s; cheap, from any thread."""
        return (host_time_ns() - self._path[-1][0]) * 1e-9

    @property
    def epoch_ns(self) -> int:
        """Host time at which the controller's clock, which runs at the host's rate, showed zero."""
        return self._clock.epoch_ns

    def start(self) -> None:
        """Switch the controller on."""
        self._thread.start()

    def start_egm_stream(self, host: str, port: int, generation: str = "B'") -> None:
        """Send the position stream to a PC, in a layout of :mod:`~robot_drivers.abb.egm.codec`; numbers begin at 0.

        Raises
        ------
        ConfigurationError
            For an unknown generation.
        """
        if generation not in GENERATIONS:
            raise ConfigurationError(f"EGM generation {generation!r} is none of {', '.join(GENERATIONS)}")
        self._order(lambda: self._egm.start_stream((host, port), generation))

    def start_guidance(
        self, host: str, port: int, settings: GuidanceSettings, generation: str = "B'"
    ) -> None:
        """Let a PC guide the arm, as the RAPID instructions EGMSetupUC, EGMAct… and EGMRun… do."""
        self._order(lambda: self._egm.start_guidance((host, port), generation, settings))

    @property
    def guidance(self) -> Guidance | None:
        """The present or last session of guidance, to be looked at only."""
        return self._egm.guidance

    def stop_egm(self) -> None:
        """End stream or guidance."""
        self._order(self._egm.stop)

    def inject(self, faults: ControllerFaults) -> None:
        """Let these faults, and no others, happen from now on."""

        def apply() -> None:
            self._rapid.faults = faults
            self._injected_s = host_time_s()
            self._restart_due = True

        self._order(apply)

    def stop_program(self) -> None:
        """Stop the motion program, as the stop button of the pendant does."""
        self._order(self._rapid.stop_program)

    def start_program(self) -> None:
        """Start the motion program again."""

        def apply() -> None:
            self._rapid.program_running = True

        self._order(apply)

    def motors_off(self) -> None:
        """Switch the motors off, as an emergency stop does; the motion program stops as well."""

        def apply() -> None:
            self._rapid.motors_on = False
            self._rapid.stop_program()

        self._order(apply)

    def motors_on(self) -> None:
        """Switch the motors on."""

        def apply() -> None:
            self._rapid.motors_on = True

        self._order(apply)

    def jog(self, T_base_tool: Pose) -> None:
        """Move the tool by hand from the pendant, past the RAPID server, and wait until it stands there.

        Raises
        ------
        MotionRefusedError
            When the arm cannot get there; it stands where it got to.
        """
        self._order(lambda: self._arm.start_line(T_base_tool, *_JOG_SPEED, landing_offset=(0.0, 0.0, 0.0)))
        while self._arm.motion is Motion.MOVING:
            time.sleep(CYCLE_S)
        if self._arm.motion is not Motion.ARRIVED:
            raise MotionRefusedError(f"the arm cannot be jogged to {T_base_tool}")

    def disturb_clock(self, jump_s: float, drift_ppm: float) -> None:
        """Let the controller's clock jump, and drift from now on; until the controller is restarted."""
        self._order(lambda: self._clock.disturb(jump_s, drift_ppm))

    def drop_connections(self) -> None:
        """Break both TCP connections."""
        self._order(self._drop_clients)

    def close(self) -> None:
        """Switch the controller off and release its ports."""
        if self._thread.is_alive():
            self._order(self._end)
            self._thread.join()
        for resource in (self._command, self._state, self._orders):
            resource.close()
        self._egm.stop()

    def __enter__(self) -> Self:
        self.start()
        return self

    def _order(self, apply: Callable[[], None]) -> None:
        """Let the cycle's thread carry out a change and wait until it has; at once if it does not run."""
        if self._thread.is_alive():
            self._orders.give(apply)
        else:
            apply()

    def _run(self) -> None:
        next_cycle_ns = host_time_ns()
        while not self._stopping:
            doors = [self._orders.waiting_on, *([self._command.waiting_on] if self._awake else [])]
            select.select(doors, [], [], seconds_until(next_cycle_ns))
            self._orders.carry_out()
            if self._awake:
                self._command.serve(self._rapid.begin_session, self._rapid.handle)
            # A few cycles a turn of many that are late: orders and commands must not wait until all are made up, and
            # to wait for each of them anew would let the rest of the laboratory run ahead of the robot.
            for _ in range(_MOST_CYCLES_A_TURN):
                if host_time_ns() < next_cycle_ns or self._stopping:
                    break
                self._cycle(next_cycle_ns)
                next_cycle_ns += _CYCLE_NS

    @property
    def _awake(self) -> bool:
        """Whether the RAPID tasks answer."""
        started = self._clock.powered_s >= self._settings.start_delay_s
        return started and self._reachable and not self._rapid.faults.mute

    @property
    def _elapsed_s(self) -> float:
        return host_time_s() - self._injected_s

    @property
    def _reachable(self) -> bool:
        return not self._rapid.faults.out_of_reach(self._elapsed_s)

    def _cycle(self, due_ns: int) -> None:
        if self._restart_due and self._elapsed_s >= self._rapid.faults.restart_at_s:
            self._restart()
        if self._rapid.faults.unpowered(self._elapsed_s):
            self._path.append((due_ns, self._arm.actual))
            return
        self._clock.tick(due_ns)
        self._held_back += self._rapid.cycle(CYCLE_S, self._command.client_silence_s)
        if self._reachable:
            for reply in self._held_back:
                self._command.send(reply)
            self._held_back.clear()
        self._path.append((due_ns, self._arm.actual))
        drop_at = self._rapid.faults.drop_at_fraction
        if drop_at is not None and self._arm.fraction_done > drop_at:
            self._drop_clients()
        if self._reachable:
            self._egm.cycle(self._clock.shown_us, self._rapid)
        if self._awake and self._clock.cycles % self._settings.state_period_cycles == 0:
            self._send_state()

    def _restart(self) -> None:
        """Lose power: what is in volatile memory begins anew, the arm stands where it was."""
        self._restart_due = False
        self._drop_clients()
        self._held_back.clear()
        self._arm.halt()
        faults, self._rapid = self._rapid.faults, RapidServer(self._settings, self._arm)
        self._rapid.faults = faults
        self._clock = ControllerClock()
        self._state_number = 0
        self._egm.restart()

    def _send_state(self) -> None:
        if self._state.accept():
            self._state_number = 0
        if self._state.has_client:
            self._state.send(self._rapid.state_frame(self._state_number, self._clock.shown_us))
            self._state_number += 1

    def _drop_clients(self) -> None:
        self._command.drop_client()
        self._state.drop_client()

    def _end(self) -> None:
        self._stopping = True
