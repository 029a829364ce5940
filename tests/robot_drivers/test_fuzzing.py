"""A short run of the fuzzer, the fuzzer itself on parsers with known faults, and what long runs have found."""

import struct
import subprocess
import sys
from random import Random

import can
import numpy as np
import pytest
from abb_robot_client._egm_protobuf import egm_pb2
from google.protobuf.message import DecodeError
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_drivers.abb.egm.codec import EgmHeader, EgmRobot, decode_robot
from robot_drivers.abb.egm.protobuf import encode
from robot_drivers.abb.rapid_socket.frames import decode_reply
from robot_drivers.abb.sequence import SequenceAccount
from robot_drivers.ati.can.link import CanLink, Request
from robot_drivers.ati.netft.command_interface import parse_calibration
from robot_drivers.cameras.pixel_formats import as_pixel_format
from robot_drivers.errors import DeviceProtocolError, DeviceTimeoutError
from robot_drivers.fuzzing import campaign
from robot_drivers.fuzzing.campaign import CHUNK, run_chunk
from robot_drivers.fuzzing.target import Target, WrongValueError
from robot_drivers.fuzzing.targets import TARGETS


@pytest.fixture
def short_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(campaign, "CHUNK", 150)


def target(check, generate=lambda random: random.randbytes(4)):
    return Target("made up", "none", generate, check)


@pytest.mark.parametrize("number", range(len(TARGETS)), ids=[target.name for target in TARGETS])
def test_no_parser_falls_over_or_passes_a_wrong_value(short_chunks: None, number: int) -> None:
    result = run_chunk(seed=20, chunk=number)
    assert result.findings == ()
    assert result.tally.inputs == 150
    assert result.tally.taken > 0, "mutations that never leave anything whole test nothing"


def test_every_parser_has_a_name_of_its_own_and_says_how_it_is_judged() -> None:
    assert len({target.name for target in TARGETS}) == len(TARGETS)
    assert all(target.oracle for target in TARGETS)


def test_a_chunk_is_the_same_every_time(short_chunks: None) -> None:
    first, second = run_chunk(3, 7), run_chunk(3, 7)
    assert (first.tally.taken, first.tally.refused) == (second.tally.taken, second.tally.refused)


def test_an_error_that_is_not_documented_is_a_finding(short_chunks: None) -> None:
    def check(data: bytes) -> bool:
        raise IndexError(data[7:])

    (finding, *_) = run_chunk(0, 0, [target(check)]).findings
    assert "IndexError" in finding.complaint


def test_a_wrong_value_is_a_finding_and_a_documented_error_is_not(short_chunks: None) -> None:
    def check(data: bytes) -> bool:
        raise WrongValueError("4 is not 5") if data[0] < 128 else DeviceProtocolError("refused")

    result = run_chunk(0, 0, [target(check)])
    assert "4 is not 5" in result.findings[0].complaint
    assert 0 < result.tally.refused < 150


@pytest.mark.skipif(sys.platform == "win32", reason="needs interval timers")
def test_a_parser_that_hangs_is_interrupted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(campaign, "CHUNK", 1)
    monkeypatch.setattr(campaign, "LONGEST_INPUT_S", 0.05)

    def check(_data: bytes) -> bool:
        while True:
            pass

    (finding,) = run_chunk(0, 0, [target(check)]).findings
    assert "needs more than" in finding.complaint


def test_the_command_tells_a_table_and_where_to_resume() -> None:
    command = [sys.executable, "-m", "robot_drivers.fuzzing", "--count", "1000", "--seed", "5"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert "0 findings" in done.stdout
    assert all(f"{target.name} " in done.stdout for target in TARGETS)
    assert f"{CHUNK:9d}" in done.stdout.splitlines()[len(TARGETS) + 1]


# ---- against another implementation of protobuf


@settings(max_examples=300)
@given(seed=st.integers(0, 2**32))
def test_what_the_egm_codec_takes_google_protobuf_reads_alike(seed: int) -> None:
    datagram = next(t for t in TARGETS if t.name == "egm-robot").generate(Random(seed))
    try:
        message = decode_robot(datagram)
    except DeviceProtocolError:
        return
    other = egm_pb2.EgmRobot()
    try:
        other.ParseFromString(datagram)
    except DecodeError:
        return  # it also knows fields of RobotWare 7 and has them as required
    if message.header is not None and message.header.seqno is not None and message.header.seqno < 2**32:
        assert other.header.seqno == message.header.seqno
    if message.feed_back is not None and message.feed_back.joints is not None:
        ours = struct.pack(f"<{len(message.feed_back.joints.joints)}d", *message.feed_back.joints.joints)
        assert ours == struct.pack(f"<{len(other.feedBack.joints.joints)}d", *other.feedBack.joints.joints)


# ---- what was found, and stays found


def test_a_field_that_is_there_twice_is_refused() -> None:
    header = encode(EgmRobot(header=EgmHeader(seqno=1)))
    with pytest.raises(DeviceProtocolError, match="there twice"):
        decode_robot(header + header)


@pytest.mark.parametrize("code", [1.5, -0.25, 3.9])
def test_a_reply_code_that_is_no_whole_number_is_refused(code: float) -> None:
    robot = (450.0, 20.0, 600.0, 0.0, 0.0, 1.0, 0.0, *[10.0] * 6)
    with pytest.raises(DeviceProtocolError, match="code"):
        decode_reply(struct.pack("<4I16f", 76, 7, 102, 3, code, 0.0, *robot, 12.0))


@pytest.mark.parametrize("last_move", [12.5, -1.0, 4_000_002.0])
def test_a_number_that_no_motion_has_is_refused(last_move: float) -> None:
    robot = (450.0, 20.0, 600.0, 0.0, 0.0, 1.0, 0.0, *[10.0] * 6)
    with pytest.raises(DeviceProtocolError, match="last move"):
        decode_reply(struct.pack("<4I16f", 76, 7, 102, 3, 0.0, 0.0, *robot, last_move))


def test_a_scale_factor_of_zero_is_refused() -> None:
    with pytest.raises(DeviceProtocolError, match="scale factors"):
        parse_calibration(bytes.fromhex("1234 02 03 000F4240 000F4240" + "0FA0" * 5 + "0000"))


def test_an_empty_image_is_refused() -> None:
    with pytest.raises(DeviceProtocolError, match="no mono8 image"):
        as_pixel_format(np.empty((4, 0, 3), np.uint8), "mono8", "left")


def test_a_message_that_comes_after_its_session_has_ended_takes_no_place_in_the_next() -> None:
    account = SequenceAccount()
    assert [account.accept(number, 100.0 + 0.004 * number) for number in range(4)] == [0, 1, 2, 3]
    assert account.accept(0, 101.0) == 4  # a new session
    assert account.accept(4, 100.016) is None  # of the old one
    assert account.accept(1, 101.004) == 5
    assert account.statistics.malformed == 1
    assert account.statistics.restarts == 1


class ReplayedBus(can.BusABC):
    """A bus on which frames come after the request."""

    channel_info = "replayed"
    _is_shutdown = True

    def __init__(self, *frames: tuple[int, bytes]) -> None:
        self.frames = [can.Message(arbitration_id=i, data=data, is_extended_id=False) for i, data in frames]
        self.asked = False

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self.asked = True

    def recv(self, timeout: float | None = None) -> can.Message | None:
        return self.frames.pop(0) if self.asked and self.frames else None


REQUEST = Request("gages", 0x200, answers=((0x200, 2), (0x201, 2)))


def test_frames_of_two_samples_are_never_joined() -> None:
    bus = ReplayedBus((0x200, b"a1"), (0x200, b"b1"), (0x201, b"b2"))
    assert CanLink(bus, "board", 0.01).ask(REQUEST).frames == (b"b1", b"b2")


def test_the_rest_of_an_answer_with_a_damaged_frame_is_not_waited_for_in_the_next() -> None:
    bus = ReplayedBus((0x200, b"a1"), (0x201, b"a"), (0x201, b"b2"))
    with pytest.raises(DeviceTimeoutError):
        CanLink(bus, "board", 0.01).ask(REQUEST)
