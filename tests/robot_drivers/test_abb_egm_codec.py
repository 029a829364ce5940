"""EGM bytes: literal vectors, a foreign protobuf implementation, and anything a network can deliver."""

import contextlib
import struct

import pytest
from abb_robot_client._egm_protobuf import egm_pb2
from hypothesis import given
from hypothesis import strategies as st

from robot_drivers.abb.egm.codec import (
    EgmCartesian,
    EgmClock,
    EgmEuler,
    EgmHeader,
    EgmJoints,
    EgmMeasuredForce,
    EgmMeasuredForceB,
    EgmMotion,
    EgmPose,
    EgmQuaternion,
    EgmRapidData,
    EgmRobot,
    EgmSensor,
    EgmSpeedRef,
    EgmState,
    EgmTimestamp,
    decode_robot,
    decode_sensor,
)
from robot_drivers.abb.egm.protobuf import encode
from robot_drivers.errors import DeviceProtocolError

POSITION = "0a1b 090000000000207c40 110000000000003440 190000000000c08240"
ORIENTATION = "1224 09000000000000f03f 110000000000000000 190000000000000000 210000000000000000"
JOINTS = (
    "0a36 090000000000000000 090000000000002440 090000000000003440"
    "090000000000000000 090000000000804640 090000000000000000"
)
MOTION = f"8701 {JOINTS} 1243 {POSITION} {ORIENTATION} 2208 08eddd01 10b49b0d"
# a datagram that the client library abb_libegm accepted and answered
DATAGRAM = bytes.fromhex(f"0a09080010a59dc50d1802 12 {MOTION} 1a {MOTION} 22020801 2a020803 3000 42020802")
SAMPLE = EgmMotion(
    joints=EgmJoints((0.0, 10.0, 20.0, 0.0, 45.0, 0.0)),
    cartesian=EgmPose(EgmCartesian(450.0, 20.0, 600.0), EgmQuaternion(1.0, 0.0, 0.0, 0.0)),
    time=EgmClock(28397, 216500),
)
MESSAGE = EgmRobot(
    header=EgmHeader(seqno=0, tm=28397221, mtype=2),
    feed_back=SAMPLE,
    planned=SAMPLE,
    motor_state=EgmState(1),
    mci_state=EgmState(3),
    mci_convergence_met=False,
    rapid_exec_state=EgmState(2),
)


def test_the_datagram_of_301_bytes_is_read_field_by_field():
    assert len(DATAGRAM) == 301
    assert decode_robot(DATAGRAM) == MESSAGE


def test_the_message_is_written_byte_by_byte():
    assert encode(MESSAGE) == DATAGRAM


def test_a_guidance_answer_of_abb_libegm_is_read_and_written_byte_by_byte():
    """165 bytes: joints, position, quaternion and Euler angles, send time 0."""
    euler = "1a1b 090000000000000000 110000000000000000 190000000000000000"
    answer = bytes.fromhex(f"0a06080010001803 12 9a01 {JOINTS} 1260 {POSITION} {ORIENTATION} {euler}")
    sensor = EgmSensor(
        header=EgmHeader(seqno=0, tm=0, mtype=3),
        planned=EgmMotion(
            joints=SAMPLE.joints,
            cartesian=EgmPose(
                EgmCartesian(450.0, 20.0, 600.0), EgmQuaternion(1.0, 0.0, 0.0, 0.0), EgmEuler(0.0, 0.0, 0.0)
            ),
        ),
    )
    assert len(answer) == 165
    assert decode_sensor(answer) == sensor
    assert encode(sensor) == answer


def test_packed_doubles_mean_the_same_as_unpacked_ones():
    packed = b"\x0a\x30" + struct.pack("<6d", 0.0, 10.0, 20.0, 0.0, 45.0, 0.0)
    inner = b"\x0a" + bytes([len(packed)]) + packed
    message = decode_robot(b"\x12" + bytes([len(inner)]) + inner)
    assert message.feed_back.joints.joints == (0.0, 10.0, 20.0, 0.0, 45.0, 0.0)


def test_unknown_fields_of_every_wire_type_are_skipped():
    unknown = bytes.fromhex("f80701 f90711223344556677 88 fa0703616263 fd07aabbccdd")
    assert decode_robot(unknown + DATAGRAM + unknown) == MESSAGE


@pytest.mark.parametrize(
    ("content", "force"),
    [
        ("09000000000000f03f" * 6, EgmMeasuredForceB(force=(1.0,) * 6)),
        ("0801" + "11000000000000f03f" * 6, EgmMeasuredForce(fc_active=True, force=(1.0,) * 6)),
        ("11000000000000f03f" * 6, EgmMeasuredForce(fc_active=None, force=(1.0,) * 6)),
    ],
    ids=["B", "C", "C without fcActive"],
)
def test_the_two_layouts_of_measured_force_are_told_apart(content, force):
    content = bytes.fromhex(content)
    message = decode_robot(bytes([0x4A, len(content)]) + content)
    assert message.measured_force == force
    assert encode(message) == bytes([0x4A, len(content)]) + content


@pytest.mark.parametrize(
    ("datagram", "complaint"),
    [
        (b"", "0 bytes"),
        (bytes(5000), "5000 bytes"),
        (DATAGRAM[:-1], "truncated"),
        (b"\x0a\x7f\x08\x00", "truncated"),
        (b"\x00\x00", "field number 0"),
        (b"\x0b\x00", "unknown wire type 3"),
        (b"\x80" * 11, "no end of the number"),
        (b"\x12\x04\x12\x02\x0a\x00", "lacks its required field x"),
        (b"\x08\x00", "EgmRobot.header: wire type 0"),
        (b"\x51" + bytes(7), "truncated"),
        (b"\x12\x05\x0a\x03\x0a\x01\x00", "no whole number of packed doubles"),
        (b"\x12\x4c\x0a\x4a\x0a\x48" + bytes(72), "more than 7 values"),
    ],
)
def test_a_malformed_datagram_is_refused_with_its_reason(datagram, complaint):
    with pytest.raises(DeviceProtocolError, match=complaint):
        decode_robot(datagram)


def test_a_foreign_codec_reads_what_we_write():
    message = EgmRobot(
        header=EgmHeader(7, 123456, 2),
        feed_back=SAMPLE,
        planned=SAMPLE,
        motor_state=EgmState(2),
        measured_force=EgmMeasuredForce(True, (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)),
        utilization_rate=87.5,
        move_index=3,
        rapid_from_robot=EgmRapidData(False, (1.5, -2.5)),
    )
    foreign = egm_pb2.EgmRobot.FromString(encode(message))
    assert (foreign.header.seqno, foreign.header.tm, foreign.header.mtype) == (7, 123456, 2)
    assert list(foreign.feedBack.joints.joints) == list(SAMPLE.joints.joints)
    assert (foreign.planned.cartesian.pos.y, foreign.planned.cartesian.orient.u0) == (20.0, 1.0)
    assert (foreign.feedBack.time.sec, foreign.feedBack.time.usec) == (28397, 216500)
    assert list(foreign.measuredForce.force) == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert (foreign.utilizationRate, foreign.moveIndex) == (87.5, 3)
    assert list(foreign.RAPIDfromRobot.dnum) == [1.5, -2.5]
    assert foreign.SerializeToString() == encode(message)


def test_timestamps_of_the_newest_generation_survive():
    message = EgmRobot(
        feed_back=EgmMotion(time_stamp=EgmTimestamp(1_700_000_000, 999_999_999)),
        torque_ref=EgmJoints((0.5,) * 6),
    )
    assert decode_robot(encode(message)) == message


reals = st.floats(allow_nan=False)
headers = st.builds(
    EgmHeader,
    seqno=st.none() | st.integers(0, 2**32 - 1),
    tm=st.none() | st.integers(0, 2**32 - 1),
    mtype=st.none() | st.integers(0, 4),
)
joints = st.builds(EgmJoints, st.lists(reals, max_size=7).map(tuple))
egm_poses = st.builds(
    EgmPose,
    st.none() | st.builds(EgmCartesian, reals, reals, reals),
    st.none() | st.builds(EgmQuaternion, reals, reals, reals, reals),
    st.none() | st.builds(EgmEuler, reals, reals, reals),
)
clocks = st.builds(EgmClock, st.integers(0, 2**64 - 1), st.integers(0, 2**64 - 1))
motions = st.builds(
    EgmMotion, st.none() | joints, st.none() | egm_poses, st.none() | joints, st.none() | clocks
)
sensors = st.builds(
    EgmSensor,
    st.none() | headers,
    st.none() | motions,
    st.none() | st.builds(EgmSpeedRef, st.none() | joints),
    st.none() | st.builds(EgmRapidData, st.none() | st.booleans(), st.lists(reals, max_size=40).map(tuple)),
)


@given(sensors)
def test_any_command_survives_the_foreign_codec_byte_for_byte(sensor):
    written = encode(sensor)
    assert egm_pb2.EgmSensor.FromString(written).SerializeToString() == written
    if written:
        assert decode_sensor(written) == sensor


@given(st.binary(max_size=400))
def test_arbitrary_bytes_are_read_or_refused_never_anything_else(datagram):
    with contextlib.suppress(DeviceProtocolError):
        decode_robot(datagram)


@given(st.integers(0, 300), st.integers(0, 255))
def test_a_damaged_datagram_is_read_or_refused_never_anything_else(position, value):
    damaged = bytearray(DATAGRAM)
    damaged[position] = value
    with contextlib.suppress(DeviceProtocolError):
        decode_robot(bytes(damaged))
