"""An emulated IRC5 that runs the open-abb server: one RAPID task that serves one client and blocks while it moves.

Written after ``SERVER.mod`` of the open-abb-driver project, weaknesses included: text after the first ``#`` is dropped,
a message without one is answered under the former code, and an acknowledgement whose client has gone is delivered to
the next one. Of its motions only MoveL is emulated; other codes are answered as illegal.
"""

import math
import socket
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

from robot_drivers.abb.emulator.arm import CYCLE_S, Arm, Motion
from robot_drivers.abb.emulator.ports import ServerPort
from robot_drivers.abb.emulator.settings import ArmSettings
from robot_drivers.abb.motion import kinematics
from robot_drivers.closing import ClosedAtExit
from robot_drivers.motion import poses
from robot_drivers.protocols import Pose

_STRING = 80
_MOVE_LINEAR, _CLOSE = 1, 99
_ORIGIN = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class OpenABBEmulatorSettings:
    """A controller.

    Attributes
    ----------
    arm : the robot
    bind_address, port : where the server listens; port 0 takes any free one
    accept_pause_s : time the server waits after it has taken a client
    serial, robotware, robot_type : what INFO tells
    """

    arm: ArmSettings = field(default_factory=ArmSettings)
    bind_address: str = "127.0.0.1"
    port: int = 0
    accept_pause_s: float = 0.5
    serial: str = "140-500000"
    robotware: str = "6.08"
    robot_type: str = "IRB 140-6/0.8"


class _ClientPort(ServerPort):
    """The server's socket, which notices a client that has gone before anything is sent to it."""

    def send_all(self, text: str) -> bool:
        """Send a string; tell whether there was a client to take it."""
        if self._client is not None:
            try:
                if self._client.recv(1, socket.MSG_PEEK) == b"":
                    self.drop_client()
            except BlockingIOError:
                pass
            except OSError:
                self.drop_client()
        self.send(text.encode("ascii"))
        return self.has_client


class OpenABBEmulator(ClosedAtExit):
    """One controller, alive from construction to :meth:`close`, also as a context manager.

    Attributes
    ----------
    mute : let the program hang: it answers nothing more
    landing_offset : how far beside its target a motion ends, m
    """

    def __init__(self, settings: OpenABBEmulatorSettings | None = None) -> None:
        self.mute = False
        self.landing_offset = _ORIGIN
        self._settings = settings or OpenABBEmulatorSettings()
        self._arm = Arm(self._settings.arm)
        self._port = _ClientPort(self._settings.bind_address, self._settings.port)
        self._T_base_wobj = poses.IDENTITY
        self._T_flange_tool = self._settings.arm.T_flange_tool
        self._speed = (100.0, 50.0)
        self._fine = False
        self._code = 0
        self._parameters = [0.0] * 10
        self._dropping = threading.Event()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="open-abb emulator")
        self._thread.start()

    @property
    def port(self) -> int:
        """TCP port of the server."""
        return self._port.port

    def pose(self) -> Pose:
        """Return where the tool truly is now, ``T_base_tool``; cheap, from any thread."""
        return self._arm.actual

    def drop_connection(self) -> None:
        """Fault: break the connection."""
        self._dropping.set()

    def close(self) -> None:
        """Switch the controller off."""
        self._closing.set()
        self._thread.join()
        self._port.close()

    def _run(self) -> None:
        program = self._program()
        next_cycle = time.monotonic()
        while not self._closing.is_set():
            self._closing.wait(max(next_cycle - time.monotonic(), 0.0))
            if self._dropping.is_set():
                self._dropping.clear()
                self._port.drop_client()
            if not self.mute:
                next(program)
            while time.monotonic() >= next_cycle:
                self._arm.step()
                next_cycle += CYCLE_S

    def _program(self) -> Iterator[None]:
        """Run the RAPID main routine; it yields wherever it has to wait."""
        yield from self._accept()
        while True:
            message = self._port.receive()[:_STRING]
            if not message:
                yield
                if not self._port.has_client:
                    yield from self._accept()
                continue
            count = self._parse(message.decode("ascii", errors="replace"))
            if self._code == _CLOSE and count == 0:
                self._port.drop_client()
                yield from self._accept()
                continue
            ok, payload = 0, ""
            routine = self._routines().get((self._code, count))
            if routine is not None:
                if self._code == _MOVE_LINEAR:
                    yield from self._until_standstill()  # of a motion that was acknowledged on its way
                ok, payload = 1, routine()
                if self._code == _MOVE_LINEAR and self._fine:
                    yield from self._until_standstill()
            while not self._port.send_all(f"{self._code} {ok} {payload}"):
                yield from self._accept()  # the error handler's RETRY: the next client gets this reply

    def _accept(self) -> Iterator[None]:
        while not self._port.accept():
            yield
        resume_at = time.monotonic() + self._settings.accept_pause_s
        while time.monotonic() < resume_at:
            yield

    def _until_standstill(self) -> Iterator[None]:
        while self._arm.motion is Motion.MOVING:
            yield
        while self._arm.motion is Motion.FAILED:  # the program has stopped with an error
            yield

    def _parse(self, text: str) -> int:
        """Do what ParseMsg does: return the number of parameters, -1 for a message that is none."""
        end = text.find("#")
        words = text[:end].split(" ")
        if end < 0 or not words[0].isdecimal():
            return -1
        self._code = int(words[0])
        for place, word in enumerate(words[1:-1]):
            try:
                self._parameters[place] = float(word)
            except ValueError:
                continue  # StrToVal leaves the former value
            except IndexError:  # beyond params{10}; what a controller does then is not known
                return -1
        return len(words) - 2

    def _routines(self) -> dict[tuple[int, int], Callable[[], str]]:
        """Return what each code with the right number of parameters does; the result is the payload."""
        return {
            (0, 0): lambda: "",
            (_MOVE_LINEAR, 7): self._move,
            (3, 0): self._report_pose,
            (4, 0): self._report_joints,
            (6, 7): self._set_tool,
            (7, 7): self._set_work_object,
            (8, 4): self._set_speed,
            (8, 2): self._set_speed,
            (9, 4): self._set_zone,
            (98, 0): lambda: "*".join(
                (self._settings.serial, self._settings.robotware, self._settings.robot_type)
            ),
        }

    def _target(self) -> Pose:
        x, y, z, *quaternion = self._parameters[:7]
        q1, q2, q3, q4 = quaternion
        return Pose((x * 1e-3, y * 1e-3, z * 1e-3), (q1, q2, q3, q4))

    def _move(self) -> str:
        target = poses.normalised(poses.compose(self._T_base_wobj, self._target()))
        linear, angular = self._speed
        self._arm.start_line(target, linear * 1e-3, math.radians(angular), self.landing_offset)
        return ""

    def _report_pose(self) -> str:
        reading = self._arm.measure()
        x, y, z = reading.position_mm
        T_base_tool = Pose((x * 1e-3, y * 1e-3, z * 1e-3), reading.quaternion_wxyz)
        seen = poses.compose(poses.inverse(self._T_base_wobj), T_base_tool)
        position = (f"{1e3 * value:.2f}" for value in seen.position)
        return " ".join((*position, *(f"{value:.3f}" for value in seen.quaternion_wxyz)))

    def _report_joints(self) -> str:
        return " ".join(f"{angle:.2f}" for angle in self._arm.measure().joints_deg)

    def _set_tool(self) -> str:
        """Set the tool frame; the arm stays where it is, and its tool is elsewhere now."""
        tool = poses.normalised(self._target())
        if tool == self._T_flange_tool:
            return ""
        self._T_flange_tool = tool
        joints = self._arm.joints
        home = poses.normalised(poses.compose(kinematics.forward(joints), tool))
        arm = replace(self._settings.arm, home=home, home_joints_near=joints, T_flange_tool=tool)
        self._arm = Arm(arm)
        return ""

    def _set_work_object(self) -> str:
        self._T_base_wobj = poses.normalised(self._target())
        return ""

    def _set_speed(self) -> str:
        self._speed = (self._parameters[0], self._parameters[1])
        return ""

    def _set_zone(self) -> str:
        self._fine = self._parameters[0] == 1
        return ""
