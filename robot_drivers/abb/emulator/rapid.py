"""The RAPID server of ``rapid/`` as a state machine: request bytes in, reply bytes out, no sockets.

It follows the modules ``RetractComm`` and ``RetractMotion`` rule by rule and lays out the bytes by itself,
not with the driver's codec.
"""

import math
import struct

from robot_drivers.abb.emulator.arm import Arm, Motion, Reading
from robot_drivers.abb.emulator.settings import EmulatorSettings, InstalledLimits
from robot_drivers.motion import poses
from robot_drivers.protocols import Pose

REQUEST_BYTES = 64

HELLO, GET_STATE, IDENTIFY, SET_LIMITS, MOVE_L, STOP, RESUME = range(1, 8)
ACCEPTED, DONE, REJECTED, ABORTED, TEXT = range(101, 106)
STATE = 201

OK, UNKNOWN_COMMAND, OUT_OF_SEQUENCE, BUSY, HOLDING, NOT_READY, BAD_TARGET, STEP, TURN, OUTSIDE, TOO_FAST = (
    range(11)
)
BAD_LIMITS, STOPPED, WATCHDOG, MOTION_ERROR, PROGRAM_STOPPED = range(11, 16)

MOTORS_ON_BIT, RUNNING_BIT, MOVING_BIT, HOLDING_BIT, WATCHDOG_BIT, ERROR_BIT = 1, 2, 4, 8, 16, 32

_PROTOCOL_VERSION = 1
_MOVE_SEQUENCES = 4_000_000
_SOME_ERRNO = 1.0  # the real one depends on what went wrong
_QUATERNION_TOLERANCE = 1e-3


class RapidServer:
    """Command server, motion task and watchdog of one controller.

    Attributes
    ----------
    motors_on, program_running : as the operator sets them
    holding : after a stop, until RESUME
    faults : what goes wrong from now on
    """

    def __init__(self, settings: EmulatorSettings, arm: Arm) -> None:
        self._settings = settings
        self._arm = arm
        self._limits = settings.limits
        self.faults = settings.faults
        self.motors_on = True
        self.program_running = True
        self.holding = False
        self._watchdog_tripped = False
        self._motion_error = False
        self._last_move = 0
        self._move_under_way = False
        self._move_reply = b""
        self._reply_due = False
        self._abort_code = OK
        self._stop_requests: list[int] = []
        self._standing_s = 0.0

    def begin_session(self) -> None:
        """Take note of a new client: no answer that an earlier one waited for goes to it."""
        self._limits = self._settings.limits
        self._reply_due = False
        self._stop_requests.clear()

    def handle(self, request: bytes) -> list[bytes] | None:
        """Answer one request of 64 bytes; None for a frame which shows that framing is lost."""
        length, seq, command, _flags, *numbers = struct.unpack("<IIII12f", request)
        if length != REQUEST_BYTES - 4:
            return None
        if command == HELLO:
            self._limits = self._settings.limits
            return [self._reply(DONE, seq, OK, _PROTOCOL_VERSION)]
        if command == GET_STATE:
            return [self._reply(DONE, seq, OK)]
        if command == IDENTIFY:
            words = f"{self._settings.serial}*{self._settings.robotware}*IRB 140-6/0.8"
            return [struct.pack("<IIII64s", 76, seq, TEXT, self.status, words.encode("ascii").ljust(64))]
        if command == SET_LIMITS:
            return [self._set_limits(seq, numbers)]
        if command == MOVE_L:
            return [self._move(seq, numbers)]
        if command == STOP:
            self._order_stop(STOPPED)
            self._stop_requests.append(seq)
            return [self._reply(ACCEPTED, seq, OK)]
        if command == RESUME:
            return [self._resume(seq)]
        return [self._reply(REJECTED, seq, UNKNOWN_COMMAND)]

    def cycle(self, cycle_s: float, client_silence_s: float | None) -> list[bytes]:
        """Advance the motion by one cycle and return the replies that fall due.

        ``client_silence_s`` is the time since the client's last request, None without a client.
        """
        arm = self._arm
        faults = self.faults
        if faults.stop_at_fraction is not None and arm.fraction_done > faults.stop_at_fraction:
            self.stop_program()
        if self._move_under_way and (
            client_silence_s is None or client_silence_s > self._settings.watchdog_s
        ):
            self._watchdog_tripped = True
            self._order_stop(WATCHDOG)
        arm.step()
        self._standing_s = 0.0 if arm.motion is Motion.MOVING else self._standing_s + cycle_s
        return [] if arm.motion is Motion.MOVING else self._report_standstill()

    def stop_program(self) -> None:
        """Stop the motion program as the controller does by itself: collision, emergency stop, pendant."""
        self.program_running = False
        self._order_stop(PROGRAM_STOPPED)

    @property
    def status(self) -> int:
        """The status bits."""
        bits = (
            (MOTORS_ON_BIT, self.motors_on),
            (RUNNING_BIT, self.program_running),
            (MOVING_BIT, self._arm.motion is Motion.MOVING),
            (HOLDING_BIT, self.holding),
            (WATCHDOG_BIT, self._watchdog_tripped),
            (ERROR_BIT, self._motion_error),
        )
        return sum(bit for bit, is_set in bits if is_set)

    def state_frame(self, number: int, controller_us: int) -> bytes:
        """Return one message of the state stream."""
        seconds, microseconds = divmod(controller_us, 1_000_000)
        return struct.pack(
            "<IIIIII13fI",
            *(76, number, STATE, self.status, seconds, microseconds),
            *_numbers(self._arm.measure()),
            self._last_move,
        )

    def _set_limits(self, seq: int, numbers: list[float]) -> bytes:
        installed = self._settings.limits
        x0, y0, z0 = lower = [max(*pair) for pair in zip(installed.lower, numbers[0:3], strict=True)]
        x1, y1, z1 = upper = [min(*pair) for pair in zip(installed.upper, numbers[3:6], strict=True)]
        bounds = (installed.step, installed.turn, installed.speed, installed.turning_speed)
        caps = list(map(min, bounds, numbers[6:10]))
        if not (
            all(map(math.isfinite, numbers[:10]))
            and all(cap > 0 for cap in caps)
            and all(low < high for low, high in zip(lower, upper, strict=True))
        ):
            return self._reply(REJECTED, seq, BAD_LIMITS)
        self._limits = InstalledLimits((x0, y0, z0), (x1, y1, z1), *caps)
        return self._reply(DONE, seq, OK)

    def _move(self, seq: int, numbers: list[float]) -> bytes:
        if seq == self._last_move != 0:
            self._reply_due = self._move_under_way
            return self._reply(ACCEPTED, seq, OK) if self._move_under_way else self._move_reply
        code, detail = self._refusal(seq, numbers)
        if code != OK:
            return self._reply(REJECTED, seq, code, detail)
        self._last_move, self._abort_code = seq, OK
        self._move_under_way = self._reply_due = True
        position = (numbers[0] * 1e-3, numbers[1] * 1e-3, numbers[2] * 1e-3)
        quaternion = (numbers[3], numbers[4], numbers[5], numbers[6])
        self._arm.start_line(
            poses.normalised(Pose(position, quaternion)),
            linear_speed=numbers[7] * 1e-3,
            angular_speed=math.radians(numbers[8]),
            landing_offset=self.faults.landing_offset,
        )
        return self._reply(ACCEPTED, seq, OK)

    def _refusal(self, seq: int, numbers: list[float]) -> tuple[int, float]:
        """Return code and detail of the first rule that forbids a motion, OK if none does."""
        limits = self._limits
        if seq != self._last_move % _MOVE_SEQUENCES + 1:
            return OUT_OF_SEQUENCE, 0.0
        if not (self.motors_on and self.program_running):
            return NOT_READY, 0.0
        if self.holding:
            return HOLDING, 0.0
        if self._move_under_way:
            return BUSY, 0.0
        target, speed, turning_speed = numbers[0:7], numbers[7], numbers[8]
        if not (all(map(math.isfinite, target)) and abs(math.hypot(*target[3:]) - 1) < _QUATERNION_TOLERANCE):
            return BAD_TARGET, 0.0
        position_mm, quaternion = numbers[0:3], (target[3], target[4], target[5], target[6])
        here = self._arm.measure()
        step = math.dist(here.position_mm, position_mm)
        if not step <= limits.step:
            return STEP, step
        origin = (0.0, 0.0, 0.0)
        _, turn = poses.distance(Pose(origin, here.quaternion_wxyz), Pose(origin, quaternion))
        if not math.degrees(turn) <= limits.turn:
            return TURN, math.degrees(turn)
        for axis, (low, value, high) in enumerate(
            zip(limits.lower, position_mm, limits.upper, strict=True), start=1
        ):
            if not low <= value <= high:
                return OUTSIDE, float(axis)
        if not 0 < speed <= limits.speed:
            return TOO_FAST, 1.0
        if not 0 < turning_speed <= limits.turning_speed:
            return TOO_FAST, 2.0
        return OK, 0.0

    def _resume(self, seq: int) -> bytes:
        if not (self.motors_on and self.program_running):
            return self._reply(REJECTED, seq, NOT_READY)
        if self._move_under_way or self._stop_requests:
            return self._reply(REJECTED, seq, BUSY)
        self.holding = self._watchdog_tripped = self._motion_error = False
        return self._reply(DONE, seq, OK)

    def _order_stop(self, code: int) -> None:
        self.holding = True
        if self._move_under_way and self._abort_code == OK:
            self._abort_code = code
            self._arm.stop()

    def _report_standstill(self) -> list[bytes]:
        replies = []
        if self._move_under_way:
            replies += self._end_of_move()
        if not self._move_under_way and self._stop_requests:
            replies += [self._reply(DONE, seq, OK) for seq in self._stop_requests]
            self._stop_requests.clear()
        return replies

    def _end_of_move(self) -> list[bytes]:
        motion = self._arm.motion
        if motion is Motion.ARRIVED and self._abort_code == OK:
            if self._standing_s < self._settings.settle_s:
                return []
            kind, code, detail = DONE, OK, 0.0
        elif motion is Motion.FAILED:
            kind, code, detail = ABORTED, MOTION_ERROR, _SOME_ERRNO
            self.holding = self._motion_error = True
        else:
            kind, code, detail = ABORTED, self._abort_code, 0.0
        self._move_under_way = False
        self._move_reply = self._reply(kind, self._last_move, code, detail)
        return [self._move_reply] if self._reply_due else []

    def _reply(self, kind: int, seq: int, code: int, detail: float = 0.0) -> bytes:
        robot = _numbers(self._arm.measure())
        return struct.pack(
            "<IIII16f", 76, seq, kind, self.status, code, detail, *robot, float(self._last_move)
        )


def _numbers(reading: Reading) -> tuple[float, ...]:
    return (*reading.position_mm, *reading.quaternion_wxyz, *reading.joints_deg)
