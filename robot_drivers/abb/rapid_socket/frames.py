r"""The bytes between the PC and the RAPID server of ``rapid/``: fixed-size little-endian frames over TCP.

Every frame begins with four uint32: **length** (bytes that follow it: 60 in a request, 76 in all others),
**seq**, **cmd**, **flags**. Sizes are fixed so that RAPID can read with ``\ReadNoOfBytes``.

Request, port 5000, 64 bytes: header, then 12 float32 (unused ones 0).

===  ==========  ==================================================================================
cmd  name        float32 payload
===  ==========  ==================================================================================
1    HELLO       none; begins a session, answers with the protocol version as detail
2    GET_STATE   none; also the heartbeat
3    IDENTIFY    none; answered by TEXT
4    SET_LIMITS  lower x y z, upper x y z (mm), step (mm), turn (°), speed (mm/s), turning speed
                 (°/s); they narrow the limits installed on the controller, never widen them
5    MOVE_L      x y z (mm), q1 q2 q3 q4 (scalar first), speed (mm/s), turning speed (°/s)
6    STOP        none; ACCEPTED when ordered, DONE at standstill
7    RESUME      none; allows motion again, moves nothing
===  ==========  ==================================================================================

Reply, port 5000, 80 bytes: **seq** is that of the request, **cmd** the kind, **flags** the status bits.

===  ==========  ==================================================================================
cmd  name        meaning
===  ==========  ==================================================================================
101  ACCEPTED    checked and begun; a DONE or ABORTED follows
102  DONE        carried out; for MOVE_L: the tool stands in position
103  REJECTED    nothing was done
104  ABORTED     begun and not finished, the tool stands elsewhere
105  TEXT        the payload is 64 ASCII bytes: serial number, RobotWare version and robot type,
                 separated by ``*``, filled up with blanks
===  ==========  ==================================================================================

Payload of the others, 16 float32: code, detail, x y z (mm), q1 q2 q3 q4, joints 1 – 6 (°), seq of the last
MOVE_L.

State, port 5001, 80 bytes, about 80 a second: **seq** counts messages, **cmd** is 201, **flags** the status
bits; then uint32 s and uint32 µs of the controller's clock (since its state task started), x y z (mm),
q1 q2 q3 q4 and joints 1 – 6 (°) as float32, uint32 seq of the last MOVE_L.

**seq** of MOVE_L runs from 1 to 4 000 000 and begins again at 1; a new one follows the last one by one. The
last one again is answered again and moves nothing; any other is rejected. HELLO's answer tells the last
one. Other requests take 4 000 001 to 8 000 000 in any way; a RAPID ``num`` (24 bits) holds them all.

**Resolution**: float32 millimetres resolve 6e-5 mm near 1000 mm, float32 degrees 1.5e-5° near 180°.
"""

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass

from robot_drivers.abb.motion.kinematics import Joints
from robot_drivers.abb.motion.limits import MotionLimits
from robot_drivers.abb.rapid_socket.codes import CAUSES, Code, Command, ReplyKind, Status
from robot_drivers.errors import ConfigurationError, DeviceProtocolError
from robot_drivers.protocols import Pose

PROTOCOL_VERSION = 1
LARGEST_MOVE_SEQUENCE = 4_000_000
LARGEST_SEQUENCE = 8_000_000
REPLY_BYTES = 80
STATE_BYTES = 80
TEXT_BYTES = 64

_SEQUENCES_OF_MOVES = (1, LARGEST_MOVE_SEQUENCE)
_SEQUENCES_OF_OTHERS = (LARGEST_MOVE_SEQUENCE + 1, LARGEST_SEQUENCE)
_REQUEST_NUMBERS = 12
_REQUEST = struct.Struct("<4I12f")
_HEADER = struct.Struct("<4I")
_REPLY = struct.Struct("<4I16f")
_STATE = struct.Struct("<6I13fI")
_LENGTH = struct.Struct("<I")
_STATE_COMMAND = 201
_LARGEST_NUMBER = 1e6  # far above any coordinate in mm or °, far below the end of float32
_QUATERNION_TOLERANCE = 1e-3
_SLACK = 0.05  # mm, °, mm/s, °/s


@dataclass(frozen=True, slots=True)
class Reply:
    """An answer of the command server; ``T_base_tool`` in m, ``joints`` in rad."""

    seq: int
    kind: ReplyKind
    status: Status
    code: Code
    detail: float
    T_base_tool: Pose
    joints: Joints
    last_move: int

    @property
    def cause(self) -> str:
        """Why the request was not carried out, and what to do."""
        return CAUSES.get(self.code, self.code.name).format(detail=self.detail)


@dataclass(frozen=True, slots=True)
class TextReply:
    """An answer in words."""

    seq: int
    text: str


@dataclass(frozen=True, slots=True)
class StateFrame:
    """One message of the state stream; clock in s, ``T_base_tool`` in m, ``joints`` in rad."""

    number: int
    status: Status
    device_time_s: float
    T_base_tool: Pose
    joints: Joints
    last_move: int


def encode_request(seq: int, command: Command, numbers: Sequence[float] = ()) -> bytes:
    """Return the 64 bytes of a request.

    Raises
    ------
    ConfigurationError
        For a sequence number or a payload that must not be sent.
    """
    lowest, highest = _SEQUENCES_OF_MOVES if command is Command.MOVE_L else _SEQUENCES_OF_OTHERS
    if not lowest <= seq <= highest:
        raise ConfigurationError(f"sequence number {seq} of {command.name} is not in {lowest} .. {highest}")
    if len(numbers) > _REQUEST_NUMBERS:
        raise ConfigurationError(f"{len(numbers)} numbers for {command.name}, at most {_REQUEST_NUMBERS} fit")
    if not all(abs(number) <= _LARGEST_NUMBER for number in numbers):
        raise ConfigurationError(f"{command.name} with {tuple(numbers)}: a number is missing or absurd")
    padding = (0.0,) * (_REQUEST_NUMBERS - len(numbers))
    return _REQUEST.pack(_REQUEST.size - _LENGTH.size, seq, command, 0, *numbers, *padding)


def move_numbers(T_base_tool: Pose, linear_speed: float, angular_speed: float) -> tuple[float, ...]:
    """Return the payload of MOVE_L; speeds in m/s and rad/s."""
    x, y, z = T_base_tool.position
    return (
        *(x * 1e3, y * 1e3, z * 1e3),
        *T_base_tool.quaternion_wxyz,
        linear_speed * 1e3,
        math.degrees(angular_speed),
    )


def limit_numbers(limits: MotionLimits) -> tuple[float, ...]:
    """Return the payload of SET_LIMITS, a little wide: the controller measures steps anew and in float32."""
    box = limits.workspace
    return (
        *(low * 1e3 - _SLACK for low in box.lower),
        *(high * 1e3 + _SLACK for high in box.upper),
        limits.step_length * 1e3 + _SLACK,
        math.degrees(limits.step_angle) + _SLACK,
        limits.linear_speed * 1e3 + _SLACK,
        math.degrees(limits.angular_speed) + _SLACK,
    )


def decode_reply(frame: bytes) -> Reply | TextReply:
    """Read a reply; raises DeviceProtocolError for what the table does not allow."""
    _check_frame(frame, REPLY_BYTES)
    _, seq, kind, flags = _HEADER.unpack_from(frame)
    if kind == ReplyKind.TEXT:
        text = frame[_HEADER.size :].decode("ascii", errors="replace")
        return TextReply(seq, text.rstrip(" \0"))
    numbers = _REPLY.unpack(frame)[4:]
    code, detail, last_move = numbers[0], numbers[1], numbers[15]
    whole = code.is_integer() and last_move.is_integer() and 0 <= last_move <= LARGEST_MOVE_SEQUENCE
    if not (whole and math.isfinite(detail)):
        raise DeviceProtocolError(f"reply {seq} with code {code}, detail {detail}, last move {last_move}")
    try:
        reply_kind, reply_code = ReplyKind(kind), Code(int(code))
    except ValueError as error:
        raise DeviceProtocolError(
            f"reply {seq}: {error}; the RAPID modules are not of this version"
        ) from None
    return Reply(
        seq, reply_kind, Status(flags), reply_code, detail, *_robot(numbers[2:15]), last_move=int(last_move)
    )


def decode_state(frame: bytes) -> StateFrame:
    """Read a message of the state stream; raises DeviceProtocolError for what the table does not allow."""
    _check_frame(frame, STATE_BYTES)
    _, number, command, flags, seconds, microseconds, *numbers, last_move = _STATE.unpack(frame)
    if command != _STATE_COMMAND:
        raise DeviceProtocolError(f"frame with cmd {command} in the state stream, {_STATE_COMMAND} expected")
    return StateFrame(
        number, Status(flags), seconds + 1e-6 * microseconds, *_robot(numbers), last_move=last_move
    )


class FrameSplitter:
    """Cuts what TCP delivers into frames of one size."""

    def __init__(self, frame_bytes: int) -> None:
        self._frame_bytes = frame_bytes
        self._rest = b""

    def split(self, received: bytes) -> list[bytes]:
        """Return the frames that are complete now.

        Raises
        ------
        DeviceProtocolError
            When a length field shows that the place in the stream is lost; the connection must be closed.
        """
        data = self._rest + received
        whole = len(data) - len(data) % self._frame_bytes
        frames = [data[start : start + self._frame_bytes] for start in range(0, whole, self._frame_bytes)]
        self._rest = data[whole:]
        for frame in frames:
            _check_frame(frame, self._frame_bytes)
        return frames


def _check_frame(frame: bytes, size: int) -> None:
    if len(frame) != size:
        raise DeviceProtocolError(f"frame of {len(frame)} bytes, {size} expected")
    length = _LENGTH.unpack_from(frame)[0]
    if length != size - _LENGTH.size:
        raise DeviceProtocolError(f"frame with length field {length}, {size - _LENGTH.size} expected")


def _robot(numbers: Sequence[float]) -> tuple[Pose, Joints]:
    """Read position (mm), quaternion and joints (°) into SI."""
    x, y, z, qw, qx, qy, qz, *angles = numbers
    if not all(map(math.isfinite, numbers)) or abs(math.hypot(qw, qx, qy, qz) - 1) > _QUATERNION_TOLERANCE:
        raise DeviceProtocolError(f"{tuple(numbers)} is no pose with six joint angles")
    j1, j2, j3, j4, j5, j6 = map(math.radians, angles)
    return Pose((x * 1e-3, y * 1e-3, z * 1e-3), (qw, qx, qy, qz)), (j1, j2, j3, j4, j5, j6)
