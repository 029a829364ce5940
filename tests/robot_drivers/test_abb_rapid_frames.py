"""The frames of the RAPID server: literal bytes on both sides, and anything a connection can deliver."""

import contextlib
import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_drivers.abb.emulator.arm import Arm
from robot_drivers.abb.emulator.rapid import RapidServer
from robot_drivers.abb.emulator.settings import ArmSettings, EmulatorSettings
from robot_drivers.abb.motion.limits import MotionLimits
from robot_drivers.abb.rapid_socket.codes import Code, Command, ReplyKind, Status
from robot_drivers.abb.rapid_socket.frames import (
    FrameSplitter,
    TextReply,
    decode_reply,
    decode_state,
    encode_request,
    limit_numbers,
    move_numbers,
)
from robot_drivers.errors import ConfigurationError, DeviceProtocolError
from robot_drivers.motion.checks import Box
from robot_drivers.protocols import Pose

# 450 mm, -12.5 mm, 350 mm; quaternion 0 0 1 0; joints 0 19.5 27.25 0 43.25 -90
ROBOT = (
    "0000e143 000048c1 0000af43"
    "00000000 00000000 0000803f 00000000"
    "00000000 00009c41 0000da41 00000000 00002d42 0000b4c2"
)
MOVE = bytes.fromhex(
    "3c000000 07000000 05000000 00000000"
    "0000e143 000048c1 0000af43"
    "00000000 00000000 0000803f 00000000"
    "0000a040 00003442 00000000 00000000 00000000"
)
REPLY = bytes.fromhex(f"4c000000 07000000 66000000 03000000 00000000 00000000 {ROBOT} 0000e040")
STATE = bytes.fromhex(f"4c000000 2a000000 c9000000 07000000 10000000 20a10700 {ROBOT} 07000000")
QUIET = EmulatorSettings(arm=ArmSettings(encoder_noise_std=0.0))


def server():
    return RapidServer(QUIET, Arm(QUIET.arm))


def test_a_move_request_has_these_64_bytes():
    pose = Pose((0.450, -0.0125, 0.350), (0.0, 0.0, 1.0, 0.0))
    numbers = move_numbers(pose, linear_speed=0.005, angular_speed=math.radians(45.0))
    assert encode_request(7, Command.MOVE_L, numbers) == MOVE
    assert len(MOVE) == 64


def test_a_reply_of_80_bytes_is_read_into_si_units():
    reply = decode_reply(REPLY)
    assert (reply.seq, reply.kind, reply.code, reply.detail, reply.last_move) == (
        7,
        ReplyKind.DONE,
        Code.OK,
        0.0,
        7,
    )
    assert reply.status == Status.MOTORS_ON | Status.PROGRAM_RUNNING
    assert reply.T_base_tool.position == pytest.approx((0.450, -0.0125, 0.350))
    assert reply.T_base_tool.quaternion_wxyz == (0.0, 0.0, 1.0, 0.0)
    assert [math.degrees(q) for q in reply.joints] == pytest.approx([0, 19.5, 27.25, 0, 43.25, -90])


def test_a_state_message_of_80_bytes_is_read_into_si_units():
    state = decode_state(STATE)
    assert (state.number, state.device_time_s, state.last_move) == (42, 16.5, 7)
    assert Status.MOVING in state.status
    assert state.T_base_tool.position == pytest.approx((0.450, -0.0125, 0.350))


def test_the_words_of_a_text_reply_lose_their_padding():
    frame = struct.pack("<4I64s", 76, 4_000_003, 105, 3, b"140-1*6.08*IRB 140".ljust(64))
    assert decode_reply(frame) == TextReply(4_000_003, "140-1*6.08*IRB 140")


def test_the_emulated_server_takes_the_same_64_bytes_and_accepts_the_first_move():
    request = bytearray(MOVE)
    struct.pack_into("<I", request, 4, 1)
    (reply,) = server().handle(bytes(request))
    assert reply[:24] == bytes.fromhex("4c000000 01000000 65000000 07000000 00000000 00000000")


def test_the_emulated_server_answers_get_state_with_these_80_bytes():
    (reply,) = server().handle(bytes.fromhex("3c000000 02093d00 02000000 00000000") + bytes(48))
    assert len(reply) == 80
    assert reply[:24] == bytes.fromhex("4c000000 02093d00 66000000 03000000 00000000 00000000")
    assert struct.unpack_from("<3f", reply, 24) == pytest.approx((450.0, 0.0, 350.0), abs=1e-3)
    assert struct.unpack_from("<4f", reply, 36) == pytest.approx((0.0, 0.0, 1.0, 0.0), abs=1e-6)
    assert struct.unpack_from("<f", reply, 76) == (0.0,)


def test_the_emulated_state_message_has_its_80_bytes():
    frame = server().state_frame(number=42, controller_us=16_500_000)
    assert len(frame) == 80
    assert frame[:24] == bytes.fromhex("4c000000 2a000000 c9000000 03000000 10000000 20a10700")
    assert frame[-4:] == bytes(4)


def test_limits_are_handed_over_in_millimetres_and_degrees_a_little_wide():
    limits = MotionLimits(
        linear_speed=0.05,
        angular_speed=math.radians(30),
        step_length=0.02,
        step_angle=math.radians(15),
        workspace=Box((0.3, -0.2, 0.1), (0.6, 0.2, 0.5)),
    )
    expected = (300, -200, 100, 600, 200, 500, 20, 15, 50, 30)
    numbers = limit_numbers(limits)
    assert numbers == pytest.approx(expected, abs=0.051)
    assert all(n < e for n, e in zip(numbers[:3], expected[:3], strict=True))
    assert all(n > e for n, e in zip(numbers[3:], expected[3:], strict=True))


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf, 1e7])
def test_a_number_that_is_none_is_never_sent(number):
    with pytest.raises(ConfigurationError, match="MOVE_L"):
        encode_request(1, Command.MOVE_L, (450.0, number, 350.0))


@pytest.mark.parametrize(
    ("seq", "command"),
    [(0, Command.MOVE_L), (4_000_001, Command.MOVE_L), (4_000_000, Command.STOP), (8_000_001, Command.STOP)],
)
def test_a_sequence_number_outside_its_range_is_never_sent(seq, command):
    with pytest.raises(ConfigurationError, match="sequence number"):
        encode_request(seq, command)


@pytest.mark.parametrize(
    ("offset", "value", "complaint"),
    [
        (0, struct.pack("<I", 60), "length field 60"),
        (8, struct.pack("<I", 99), "99 is not a valid ReplyKind"),
        (16, struct.pack("<f", 77.0), "77 is not a valid Code"),
        (16, struct.pack("<f", math.nan), "code nan"),
        (24, struct.pack("<f", math.inf), "no pose"),
        (36, struct.pack("<4f", 0.0, 0.0, 0.5, 0.0), "no pose"),
    ],
)
def test_a_reply_that_the_table_does_not_allow_is_refused(offset, value, complaint):
    frame = bytearray(REPLY)
    frame[offset : offset + len(value)] = value
    with pytest.raises(DeviceProtocolError, match=complaint):
        decode_reply(bytes(frame))


def test_another_frame_in_the_state_stream_is_refused():
    with pytest.raises(DeviceProtocolError, match="cmd 102 in the state stream"):
        decode_state(REPLY)


@given(st.lists(st.integers(1, 200), max_size=20))
def test_frames_are_found_however_tcp_cuts_them(cuts):
    stream = REPLY * 10
    splitter = FrameSplitter(80)
    frames, position = [], 0
    for cut in [*cuts, len(stream)]:
        frames += splitter.split(stream[position : position + cut])
        position = min(position + cut, len(stream))
    assert frames == [REPLY] * 10


def test_a_lost_place_in_the_stream_is_noticed():
    with pytest.raises(DeviceProtocolError, match="length field"):
        FrameSplitter(80).split(REPLY[1:] + REPLY)


@given(st.binary(min_size=80, max_size=80))
def test_arbitrary_frames_are_read_or_refused_never_anything_else(frame):
    for decode in (decode_reply, decode_state):
        with contextlib.suppress(DeviceProtocolError):
            decode(frame)


@given(st.binary(min_size=76, max_size=76))
def test_arbitrary_content_of_the_right_length_is_read_or_refused(content):
    for decode in (decode_reply, decode_state):
        with contextlib.suppress(DeviceProtocolError):
            decode(struct.pack("<I", 76) + content)


@given(st.binary(min_size=60, max_size=60))
def test_the_emulated_server_survives_arbitrary_requests(content):
    emulated = server()
    replies = emulated.handle(struct.pack("<I", 60) + content)
    assert all(len(reply) == 80 for reply in replies)
