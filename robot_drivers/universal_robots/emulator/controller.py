"""The emulated controller: its RTDE server, its clock, and the arm, all in one thread that goes from cycle to cycle."""

import contextlib
import socket
import threading
from collections.abc import Callable, Iterable
from random import Random

from robot_drivers.clock import host_time_s
from robot_drivers.closing import ClosedAtExit
from robot_drivers.errors import DeviceProtocolError
from robot_drivers.protocols import Pose
from robot_drivers.specification import Six
from robot_drivers.universal_robots.emulator.arm import EmulatedArm
from robot_drivers.universal_robots.emulator.client import EmulatedClient
from robot_drivers.universal_robots.emulator.settings import CYCLE_S, UREmulatorSettings, URFaults
from robot_drivers.universal_robots.robot.registers import INPUTS
from robot_drivers.universal_robots.rtde.packages import Kind, Value

WrenchSource = Callable[[float], Iterable[float]]
_NO_WRENCH: Six = (0.0,) * 6
_MOST_CYCLES_AT_ONCE = 5000


class URControllerEmulator(ClosedAtExit):
    """A controller that listens from construction to :meth:`close`; a context manager.

    Parameters
    ----------
    wrench : what the sensor in the flange reads (6,), N and N·m, at a time of the controller's clock, s
    """

    def __init__(
        self, settings: UREmulatorSettings | None = None, wrench: WrenchSource | None = None
    ) -> None:
        self.settings = settings = settings or UREmulatorSettings()
        self._wrench = wrench or (lambda _: _NO_WRENCH)
        self._arm = EmulatedArm(settings)
        self._random = Random(settings.seed)
        self._registers: dict[str, Value] = {name: 0 if "int" in name else 0.0 for name in INPUTS}
        self._clients: list[EmulatedClient] = []
        self._lock = threading.Lock()
        self._faults, self._injected_s = URFaults(), host_time_s()
        self._began_s, self._done = host_time_s(), 0
        self._listener = socket.create_server((settings.bind_address, settings.port))
        self._listener.setblocking(False)
        self.port: int = self._listener.getsockname()[1]
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="ur-controller", daemon=True)
        self._thread.start()

    def pose(self) -> Pose:
        """Return where the tool is."""
        with self._lock:
            return self._arm.T_base_tool

    def inject(self, faults: URFaults) -> None:
        """Let these things go wrong from now on, and no others."""
        with self._lock:
            self._faults, self._injected_s = faults, host_time_s()

    def close(self) -> None:
        """Switch it off."""
        self._closing.set()
        self._thread.join()
        self._listener.close()
        self._hang_up()

    def _run(self) -> None:
        while not self._closing.wait(CYCLE_S):
            with self._lock:
                elapsed_s = host_time_s() - self._injected_s
                if self._faults.unpowered(elapsed_s):
                    self._power_off()
                    continue
                reached = not self._faults.out_of_reach(elapsed_s)
                if reached:
                    self._accept()
                self._cycles(reached)

    def _power_off(self) -> None:
        """Hang up, and forget everything but where the arm stands."""
        self._hang_up()
        with contextlib.suppress(BlockingIOError):
            while True:
                self._listener.accept()[0].close()
        self._registers = {name: 0 if "int" in name else 0.0 for name in INPUTS}
        self._began_s, self._done = host_time_s(), 0

    def _accept(self) -> None:
        with contextlib.suppress(BlockingIOError):
            connection, _ = self._listener.accept()
            self._clients.append(EmulatedClient(connection))

    def _hear(self) -> None:
        for client in list(self._clients):
            try:
                for package in client.hear():
                    if package.kind is Kind.DATA:
                        recipe = client.inputs.get(package.content[0])
                        if recipe is not None:
                            self._registers |= recipe.decode(package.content)
                        continue
                    others = [other for other in self._clients if other is not client]
                    taken = frozenset(name for name in INPUTS if any(other.writes(name) for other in others))
                    client.answer(package, self.settings.software, taken)
            except (OSError, DeviceProtocolError):
                client.close()
                self._clients.remove(client)

    def _cycles(self, reached: bool) -> None:
        """Go on to the present, cycle by cycle."""
        behind = int((host_time_s() - self._began_s) / CYCLE_S) - self._done
        self._done += max(0, behind - _MOST_CYCLES_AT_ONCE)  # the process was stopped for as long
        for _ in range(min(behind, _MOST_CYCLES_AT_ONCE)):
            self._done += 1
            if reached:
                self._hear()
            self._arm.step(self._registers, self._faults)
            if reached and not self._faults.mute:
                self._tell()

    def _tell(self) -> None:
        due = [client for client in self._clients if client.started and self._done % client.every == 0]
        if not due:
            return
        clock_s = self._done * CYCLE_S * (1.0 + self.settings.clock_ppm * 1e-6)
        noise = self.settings.noise_std
        wrench = tuple(
            float(part) + self._random.gauss(0.0, std)
            for part, std in zip(self._wrench(clock_s), noise, strict=True)
        )
        values: dict[str, Value] = {
            **self._arm.outputs(self._faults),
            "timestamp": clock_s,
            "ft_raw_wrench": wrench,
            "actual_TCP_force": wrench,
            "robot_status_bits": 3,
            "safety_status_bits": 1,
        }
        for client in due:
            try:
                self._tell_one(client, values)
            except OSError:
                client.close()
                self._clients.remove(client)

    def _tell_one(self, client: EmulatedClient, values: dict[str, Value]) -> None:
        faults, random = self._faults, self._random
        if random.random() < faults.loss:
            return
        content = client.tell(values)
        if random.random() < faults.rubbish:
            client.send(Kind.DATA, bytes([(content[0] + 1) % 256]) + content[1:])
        if random.random() < faults.cut:
            client.send(Kind.DATA, content[:-5])

    def _hang_up(self) -> None:
        for client in self._clients:
            client.close()
        self._clients.clear()
