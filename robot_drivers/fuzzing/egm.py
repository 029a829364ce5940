"""Fuzz targets: Externally Guided Motion - messages of the controller and of the PC, and their numbering."""

import struct
from collections.abc import Container
from random import Random

from robot_drivers.abb.egm.codec import EgmRobot, decode_robot, decode_sensor
from robot_drivers.abb.egm.position_stream import EGMSample, classify, to_sample
from robot_drivers.abb.sequence import SequenceAccount
from robot_drivers.fuzzing.mutations import mutated, overwritten
from robot_drivers.fuzzing.target import Target, WrongValueError, agree

Path = tuple[int, ...]
Value = int | bytes

_MOTION = bytes.fromhex(
    "0a36 090000000000000000 090000000000002440 090000000000003440 090000000000000000 090000000000804640"
    "090000000000000000 1243 0a1b 090000000000207c40 110000000000003440 190000000000c08240"
    "1224 09000000000000f03f 110000000000000000 190000000000000000 210000000000000000"
    "2208 08eddd01 10b49b0d"
)
_STATES = bytes.fromhex("22020801 2a020803 3000 42020802")
_HEADER = bytes.fromhex("0a09080010a59dc50d1802")


def _field(number: int, content: bytes) -> bytes:
    length = len(content)
    size = bytes([length]) if length < 128 else bytes([length & 0x7F | 0x80, length >> 7])
    return bytes([number << 3 | 2]) + size + content


_FORCES = b"".join(b"\x09" + struct.pack("<d", value) for value in (1.0, -2.0, 3.0, 0.1, 0.2, 0.3))
_ROBOT = _HEADER + _field(2, _MOTION) + _field(3, _MOTION) + _STATES
_ROBOTS = (
    _ROBOT,
    _HEADER + _field(2, _MOTION[:-10]) + _field(3, _MOTION[:-10]) + _STATES,  # before 6.07: no time
    _ROBOT + _field(9, _FORCES) + b"\x51" + struct.pack("<d", 50.0),
    _ROBOT + _field(9, b"\x08\x00" + _FORCES.replace(b"\x09", b"\x11", 6)) + b"\x58\x07",
)
_SENSOR = bytes.fromhex("0a06080010001803") + _field(2, _MOTION[:-10])
_SENSORS = (_SENSOR, _SENSOR + _field(3, _field(2, _FORCES)))


def _robot(random: Random) -> bytes:
    return (mutated if random.random() < 0.5 else overwritten)(random, _ROBOTS)


def _check_robot(datagram: bytes) -> bool:
    """Every number of a sample is found where another reading of the bytes has it, and nowhere twice."""
    message = decode_robot(datagram)
    sample = to_sample(message, 0, "rad")
    told = _leaves(datagram, _ROBOT_MESSAGES)
    untimed = message.feed_back is None or message.feed_back.time is None
    degree = 1.0 if untimed else 0.017453292519943295
    agree(sample.number, _one(told, (1, 1)), "sequence number")
    agree([p * 1e3 for p in sample.pose.position], _near(_doubles(told, (2, 2, 1), 3), sample), "position")
    agree(list(sample.pose.quaternion_wxyz), _doubles(told, (2, 2, 2), 4), "quaternion")
    agree(list(sample.joints), [degree * q for q in _repeated(told, (2, 1, 1))], "joints")
    if (3,) in {path[:1] for path in told}:
        agree(list(sample.planned_joints), [degree * q for q in _repeated(told, (3, 1, 1))], "planned joints")
    if untimed:
        agree(sample.device_time_s, 1e-3 * int(_one(told, (1, 2))), "send time")
    else:
        clock_s = int(_one(told, (2, 4, 1))) + 1e-6 * int(_one(told, (2, 4, 2)))
        agree(sample.device_time_s, clock_s, "clock")
    for number, state in ((4, message.motor_state), (5, message.mci_state), (8, message.rapid_exec_state)):
        if state is not None:
            agree(state.state, _one(told, (number, 1)), f"state in field {number}")
    if classify(message) not in ("A", "B", "B'", "C", "D"):
        raise WrongValueError("a generation that there is not")
    _check_force(message, told)
    return True


def _check_force(message: EgmRobot, told: dict[Path, list[Value]]) -> None:
    force = () if message.measured_force is None else message.measured_force.force
    if force:
        found = [_content(told, (9, number)) for number in (1, 2)]
        agree(struct.pack(f"<{len(force)}d", *force) in found, True, "measured force")


def _near(expected: list[float], sample: EGMSample) -> list[float]:
    """Return the expected millimetres as they come back from metres."""
    metres = [value * 1e-3 for value in expected]
    return [value * 1e3 for value in metres] if list(sample.pose.position) == metres else expected


def _check_sensor(datagram: bytes) -> bool:
    message = decode_sensor(datagram)
    told = _leaves(datagram, _SENSOR_MESSAGES)
    if message.header is not None and message.header.seqno is not None:
        agree(message.header.seqno, _one(told, (1, 1)), "sequence number")
    cartesian = None if message.planned is None else message.planned.cartesian
    if cartesian is not None and cartesian.pos is not None:
        p = cartesian.pos
        agree(struct.pack("<3d", p.x, p.y, p.z), _packed(told, (2, 2, 1), 3), "position")
    if cartesian is not None and cartesian.orient is not None:
        q = cartesian.orient
        agree(struct.pack("<4d", q.u0, q.u1, q.u2, q.u3), _packed(told, (2, 2, 2), 4), "quaternion")
    return True


def _leaves(data: bytes, messages: Container[Path]) -> dict[Path, list[Value]]:
    """Read wire bytes: the values by their path of field numbers, in order; ``messages`` are to be looked into."""
    leaves: dict[Path, list[Value]] = {}
    _collect(data, (), leaves, messages)
    return leaves


def _collect(data: bytes, path: Path, leaves: dict[Path, list[Value]], messages: Container[Path]) -> None:
    place = 0
    while place < len(data):
        key, place = _number(data, place)
        here = (*path, key >> 3)
        if key & 7 == 0:
            value, place = _number(data, place)
            leaves.setdefault(here, []).append(value)
        elif key & 7 == 2:
            length, place = _number(data, place)
            content, place = data[place : place + length], place + length
            leaves.setdefault(here, []).append(content)
            if here in messages:
                _collect(content, here, leaves, messages)
        else:
            length = 8 if key & 7 == 1 else 4
            leaves.setdefault(here, []).append(data[place : place + length])
            place += length


_POSES = {
    *((motion, part) for motion in (2, 3) for part in (1, 2, 4)),
    *((motion, 2, part) for motion in (2, 3) for part in (1, 2)),
}
_SENSOR_MESSAGES = {(1,), (2,), (3,)} | _POSES
_ROBOT_MESSAGES = {(1,), (2,), (3,), (4,), (5,), (8,), (9,)} | _POSES


def _number(data: bytes, place: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        byte = data[place]
        value, shift, place = value | (byte & 0x7F) << shift, shift + 7, place + 1
        if byte < 0x80:
            return value, place


def _one(told: dict[Path, list[Value]], path: Path) -> Value:
    """Return the only value at a path; two of them would be a matter of taste, and none was to be taken."""
    values = told.get(path, [])
    if len(values) != 1:
        raise WrongValueError(f"field {path} is there {len(values)} times and was taken for good")
    return values[0]


def _packed(told: dict[Path, list[Value]], path: Path, count: int) -> bytes:
    return b"".join(value for n in range(count) if isinstance(value := _one(told, (*path, 1 + n)), bytes))


def _doubles(told: dict[Path, list[Value]], path: Path, count: int) -> list[float]:
    return list(struct.unpack(f"<{count}d", _packed(told, path, count)))


def _repeated(told: dict[Path, list[Value]], path: Path) -> list[float]:
    return [value for (value,) in struct.iter_unpack("<d", _content(told, path))]


def _content(told: dict[Path, list[Value]], path: Path) -> bytes:
    return b"".join(value for value in told.get(path, []) if isinstance(value, bytes))


Message = tuple[int, int, float]
"""True place, number, and clock of the controller, s."""

_REBOOT_S = 10.0


def _numbering(random: Random) -> list[Message]:
    """Return (true place, number, clock) of messages as they arrive, over sessions and reboots."""
    arriving: list[Message] = []
    place, clock_s = 0, 28397.2
    for boot_s in (5000.0, 1000.0, 0.0)[: random.choice((1, 1, 2, 3))]:
        number = random.choice((0, 0, 352216, 2**32 - 10))
        rebooted = random.random() < 0.3
        clock_s = boot_s if rebooted else clock_s + 0.5
        session: list[Message] = []
        for step in range(random.randrange(1, 60)):
            session.append((place, (number + step) % 2**32, clock_s))
            place, clock_s = place + 1, clock_s + 0.004
        loss, doubling, swapping = (random.choice((0.0, 0.02, 0.2)) for _ in range(3))
        for message in session:
            if random.random() >= loss:
                arriving.append(message)
            if random.random() < doubling:
                arriving.append(message)
            if random.random() < swapping and _can_overtake(arriving):
                arriving[-1], arriving[-2] = arriving[-2], arriving[-1]
        place += 1_000_000
    return arriving


def _can_overtake(arriving: list[Message]) -> bool:
    """Tell whether the last two messages can have changed places: none is as late as a reboot takes."""
    return len(arriving) > 1 and abs(arriving[-1][2] - arriving[-2][2]) < _REBOOT_S


def _check_numbering(arriving: list[Message]) -> bool:
    """No message counts twice, and within a session counters differ as the messages' places do."""
    account, counters, offsets = SequenceAccount(), dict[int, int](), dict[int, set[int]]()
    for place, number, clock_s in arriving:
        counter = account.accept(number, clock_s)
        if counter is None:
            continue
        if place in counters or counter in counters.values():
            raise WrongValueError(f"message {place} or its counter {counter} was delivered twice")
        counters[place] = counter
        offsets.setdefault(place // 1_000_000, set()).add(counter - place)
    agree(account.statistics.received, len(counters), "count of received messages")
    moved = {session: found for session, found in offsets.items() if len(found) > 1}
    if moved:
        raise WrongValueError(f"messages were moved against each other: {moved}")
    return bool(counters)


TARGETS = (
    Target("egm-robot", "a reading without schema finds the same numbers, each once", _robot, _check_robot),
    Target(
        "egm-sensor",
        "a reading without schema finds the same numbers, each once",
        lambda random: (mutated if random.random() < 0.5 else overwritten)(random, _SENSORS),
        _check_sensor,
    ),
    Target("egm-numbering", "each message carries its true place", _numbering, _check_numbering),
)
