"""Fuzz targets: the RAPID server's replies and its state stream."""

import math
import struct
from collections.abc import Callable
from random import Random

from robot_drivers.abb.motion.kinematics import Joints
from robot_drivers.abb.rapid_socket.frames import FrameSplitter, TextReply, decode_reply, decode_state
from robot_drivers.fuzzing.mutations import mutated, overwritten
from robot_drivers.fuzzing.target import Target, WrongValueError, agree
from robot_drivers.protocols import Pose

_LENGTH = struct.pack("<I", 76)
_ROBOT = (450.0, 20.0, 600.0, 0.0, 0.0, 1.0, 0.0, 0.0, 10.0, 20.0, 0.0, 45.0, 0.0)
_REPLY = struct.pack("<4I16f", 76, 7, 102, 3, 0.0, 0.0, *_ROBOT, 12.0)
_REJECTION = struct.pack("<4I16f", 76, 8, 103, 3, 7.0, 12.5, *_ROBOT, 12.0)
_TEXT = struct.pack("<4I64s", 76, 9, 105, 3, b"140-500000*6.08*IRB 140-6/0.8".ljust(64))
_STATE = struct.pack("<6I13fI", 76, 5, 201, 3, 28397, 216500, *_ROBOT, 12)


def _frames(*seeds: bytes) -> Callable[[Random], bytes]:
    """Make damaged frames, most of them with their length field intact."""

    def generate(random: Random) -> bytes:
        frame = (mutated if random.random() < 0.2 else overwritten)(random, seeds)
        return frame if random.random() < 0.3 else _LENGTH + frame[4:]

    return generate


def _check_reply(frame: bytes) -> bool:
    reply = decode_reply(frame)
    if isinstance(reply, TextReply):
        agree((reply.seq, frame[8]), (int.from_bytes(frame[4:8], "little"), 105), "text")
        return True
    agree(struct.pack("<4I", 76, reply.seq, reply.kind, reply.status), frame[:16], "reply")
    agree((reply.code, reply.detail), struct.unpack_from("<2f", frame, 16), "code and detail")
    agree((reply.last_move,), struct.unpack_from("<f", frame, 76), "last motion")
    _check_robot(reply.T_base_tool, reply.joints, frame[24:76])
    return True


def _check_state(frame: bytes) -> bool:
    state = decode_state(frame)
    agree(struct.pack("<4I", 76, state.number, 201, state.status), frame[:16], "state")
    seconds, microseconds = struct.unpack_from("<II", frame, 16)
    agree(state.device_time_s, seconds + 1e-6 * microseconds, "clock")
    agree(state.last_move, int.from_bytes(frame[76:], "little"), "last motion")
    _check_robot(state.T_base_tool, state.joints, frame[24:76])
    return True


def _check_robot(pose: Pose, joints: Joints, numbers: bytes) -> None:
    said = struct.unpack("<13f", numbers)
    parsed = (*(1e3 * p for p in pose.position), *pose.quaternion_wxyz, *map(math.degrees, joints))
    same = all(math.isclose(a, b, rel_tol=1e-12, abs_tol=1e-300) for a, b in zip(parsed, said, strict=True))
    if not same or abs(math.hypot(*said[3:7]) - 1) > 2e-3:
        raise WrongValueError(f"pose and joints {parsed} of {said}")


def _pieces(random: Random) -> list[bytes]:
    stream = b"".join(random.choice((_STATE, _REPLY)) for _ in range(random.randrange(1, 6)))
    if random.random() < 0.5:
        stream = mutated(random, [stream])
    pieces = []
    while stream:
        size = random.choice((1, 79, 80, 81, random.randrange(1, 400)))
        pieces.append(stream[:size])
        stream = stream[size:]
    return pieces


def _check_pieces(pieces: list[bytes]) -> bool:
    splitter = FrameSplitter(80)
    frames = [frame for piece in pieces for frame in splitter.split(piece)]
    stream = b"".join(pieces)
    agree(b"".join(frames), stream[: len(stream) // 80 * 80], "frames laid end to end")
    agree({frame[:4] for frame in frames} <= {_LENGTH}, True, "their length fields")
    return bool(frames)


TARGETS = (
    Target(
        "rapid-reply", "its numbers as struct reads them", _frames(_REPLY, _REJECTION, _TEXT), _check_reply
    ),
    Target("rapid-state", "its numbers as struct reads them", _frames(_STATE), _check_state),
    Target("rapid-splitter", "frames laid end to end are what came", _pieces, _check_pieces),
)
