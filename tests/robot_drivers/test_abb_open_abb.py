"""The open-abb client and the emulated server: their bytes, what the protocol cannot do, and what never happens."""

import contextlib
import dataclasses
import math
import re
import socket
import time

import numpy as np
import pytest
from abb_motions import moving, shifted, stands

from robot_drivers.abb.emulator.open_abb import OpenABBEmulator, OpenABBEmulatorSettings
from robot_drivers.abb.emulator.settings import ArmSettings
from robot_drivers.abb.motion.limits import MotionLimits
from robot_drivers.abb.open_abb import OpenABB, OpenABBSettings, messages
from robot_drivers.errors import (
    ConfigurationError,
    DeviceFaultError,
    DeviceProtocolError,
    DeviceTimeoutError,
    DeviceUnreachableError,
    MotionRefusedError,
)
from robot_drivers.motion import poses
from robot_drivers.motion.arrival import MotionInterruptedError
from robot_drivers.protocols import Pose, Speed

SPEED = Speed(linear=0.05, angular=0.3)
SLOW = Speed(linear=0.01, angular=0.3)
QUICK = OpenABBEmulatorSettings(accept_pause_s=0.01, arm=ArmSettings(encoder_noise_std=0.0))


@pytest.fixture
def emulator():
    with OpenABBEmulator(QUICK) as emulator:
        yield emulator


@pytest.fixture
def home(emulator):
    return emulator.pose()


def settings_for(emulator, **changes):
    basic = OpenABBSettings(
        "127.0.0.1",
        emulator.port,
        limits=MotionLimits(step_length=0.03),
        stop_within_s=0.2,
        poll_period_s=0.01,
        reply_gap_s=0.01,
    )
    return dataclasses.replace(basic, **changes)


@contextlib.contextmanager
def connected(emulator, **changes):
    robot = OpenABB(settings_for(emulator, **changes))
    robot.connect()
    try:
        yield robot
    finally:
        robot.close()


@pytest.fixture
def robot(emulator):
    with connected(emulator) as robot:
        yield robot


@contextlib.contextmanager
def bare_client(emulator):
    """A socket on which :func:`say` speaks the protocol by hand."""
    with socket.create_connection(("127.0.0.1", emulator.port), timeout=3.0) as connection:
        yield connection


def say(connection, text):
    connection.sendall(text.encode())
    return connection.recv(4096).decode()


# ---- bytes


DOWN = Pose((0.45, -0.0123, 0.35), (0.0, 0.0, 1.0, 0.0))


def test_requests_have_the_format_of_the_projects_own_client():
    assert messages.request(messages.Code.PING) == b"00 #"
    assert messages.request(messages.Code.INFO) == b"98 #"
    move = messages.request(messages.Code.MOVE_LINEAR, *messages.pose_parameters(DOWN, decimals=1))
    assert move == b"01 +00450.0 -00012.3 +00350.0 +0.00000 +0.00000 +1.00000 +0.00000 #"
    speed = messages.request(messages.Code.SPEED, *messages.speed_parameters(Speed(0.1, 0.5), decimals=1))
    assert speed == b"08 +00100.0 +0028.65 +00100.0 +0028.65 #"
    zone = messages.request(messages.Code.ZONE, *messages.fine_zone_parameters())
    assert zone == b"09 1 +00.0000 +00.0000 +00.0000 #"


def test_more_decimals_fit_into_the_80_characters_that_the_server_reads():
    far = Pose((-1.2345678, -1.2345678, -1.2345678), (-0.5, -0.5, -0.5, -0.5))
    request = messages.request(messages.Code.MOVE_LINEAR, *messages.pose_parameters(far, decimals=3))
    assert request.startswith(b"01 -1234.568 -1234.568 -1234.568 ")
    assert len(request) <= 80
    with pytest.raises(ConfigurationError, match="fewer decimals"):
        messages.request(messages.Code.MOVE_LINEAR, *messages.pose_parameters(far, decimals=9))


def test_replies_are_parsed():
    assert messages.parse_reply(b"1 1 ") == messages.Reply(1, True, "")
    assert messages.parse_reply(b"0 0 ") == messages.Reply(0, False, "")
    pose = messages.parse_pose(
        messages.parse_reply(b"3 1 450.00 -12.30 350.01 0.000 0.000 1.000 0.000").payload
    )
    assert pose.position == pytest.approx((0.45, -0.0123, 0.35001))
    assert pose.quaternion_wxyz == (0.0, 0.0, 1.0, 0.0)
    joints = messages.parse_joints("0.00 22.55 12.50 0.00 -180.00 90.00")
    assert joints == pytest.approx([math.radians(q) for q in (0, 22.55, 12.5, 0, -180, 90)])


@pytest.mark.parametrize(
    "before", [b"", b"1 1 ", b"3 1 450.00 0.00 350.00 0.000 0.000 1.000 0.00", b"98 1 old*6*old"]
)
def test_the_answer_to_the_greeting_is_told_from_what_an_earlier_client_left(before):
    assert messages.find_info(before + b"98 1 140-500000*6.08*IRB 140") == "140-500000*6.08*IRB 140"
    assert messages.find_info(before + b"98 1 140-500000*6.0") is None


@pytest.mark.parametrize("reply", [b"", b"1", b"1 ", b"1 2 ", b"abc", b"1 1", b"999 1 ", b"\xff 1 "])
def test_what_is_no_reply_is_refused(reply):
    with pytest.raises(DeviceProtocolError, match="open-abb"):
        messages.parse_reply(reply)


@pytest.mark.parametrize(
    "payload",
    [
        "450.00 0.00 350.00 0.000 0.000 1.000",
        "450.00 0.00 350.00 0.000 0.000 1.000 0.000 0.000",
        "450.00 0.00 350.00 0.000 0.000 0.500 0.000",
        "nan 0.00 350.00 0.000 0.000 1.000 0.000",
        "450.00 # 350.00 0.000 0.000 1.000 0.000",
        "4_0.00 0.00 350.00 0.000 0.000 1.000 0.000",
        "450.00 0.00 350.00 0.000 0.000 1.0_0 0.000",
    ],
)
def test_what_is_no_pose_is_refused(payload):
    with pytest.raises(DeviceProtocolError):
        messages.parse_pose(payload)


def test_a_speed_that_would_be_sent_as_zero_is_refused():
    with pytest.raises(ConfigurationError, match="rounds to zero"):
        messages.speed_parameters(Speed(0.00002, 0.3), decimals=1)


@pytest.mark.parametrize(
    ("sent", "received"),
    [
        ("00 #", "0 1 "),
        ("03 #", "3 1 450.00 0.00 350.00 0.000 0.000 1.000 0.000"),
        ("98 #", "98 1 140-500000*6.08*IRB 140-6/0.8"),
        ("08 +00100.0 +0050.00 +00100.0 +0050.00 #", "8 1 "),
        ("08 +00100.0 +0050.00 #", "8 1 "),
        ("09 1 +00.0000 +00.0000 +00.0000 #", "9 1 "),
        ("01 +00450.0 #", "1 0 "),
        ("42 #", "42 0 "),
        ("00 #03 #", "0 1 "),
    ],
)
def test_the_emulated_server_answers_as_the_project_does(emulator, sent, received):
    with bare_client(emulator) as connection:
        assert say(connection, sent) == received


def test_a_message_without_its_end_is_answered_under_the_former_code(emulator):
    with bare_client(emulator) as connection:
        assert say(connection, "03 #").startswith("3 1 ")
        assert say(connection, "00") == "3 0 "


def test_at_a_fly_by_point_the_emulated_server_acknowledges_before_arrival(emulator, home):
    target = messages.request(
        messages.Code.MOVE_LINEAR, *messages.pose_parameters(shifted(home, dx=0.01), decimals=1)
    )
    with bare_client(emulator) as connection:
        say(connection, "08 +00010.0 +0050.00 #")
        assert say(connection, target.decode()) == "1 1 "
        assert emulator.pose().position[0] < home.position[0] + 0.005
        assert say(connection, "09 1 +00.0000 +00.0000 +00.0000 #") == "9 1 "
        assert say(connection, target.decode()) == "1 1 "
        assert emulator.pose().position[0] == pytest.approx(home.position[0] + 0.01, abs=1e-4)


def test_joints_come_with_two_decimals(emulator):
    with bare_client(emulator) as connection:
        assert re.fullmatch(r"4 1( -?\d+\.\d\d){6}", say(connection, "04 #"))


# ---- driver


def test_the_identity_tells_what_the_protocol_cannot_do(robot):
    identity = robot.identity
    assert identity.serial == "140-500000"
    assert identity.details["robotware"] == "6.08"
    assert "no state stream" in identity.details["pose_source"]
    assert "within 0.2 s" in identity.details["stop"]


def test_connecting_moves_nothing(emulator, robot, home):
    assert emulator.pose() == home
    assert stands(emulator)
    assert robot.state().ready


def test_a_motion_ends_at_its_target_to_the_resolution_of_the_protocol(emulator, robot, home):
    target = shifted(home, dx=0.0123, dz=0.0056789)
    reached = robot.move_linear(target, SPEED, timeout_s=10.0)
    assert reached.position == pytest.approx(target.position, abs=3e-5)
    assert emulator.pose().position == pytest.approx(target.position, abs=5e-5)


def test_one_decimal_sends_what_the_projects_own_client_would(emulator, home):
    with connected(emulator, position_decimals=1) as robot:
        robot.move_linear(shifted(home, dx=0.01004), SPEED, timeout_s=10.0)
    assert emulator.pose().position[0] == pytest.approx(home.position[0] + 0.0100, abs=4e-5)


def test_a_tool_frame_is_handed_over_and_checked(emulator):
    flange = emulator.pose()
    tool = Pose((0.0, 0.0, 0.12))
    with connected(emulator, T_flange_tool=tool) as robot:
        here = robot.state().T_base_tool
    assert here.position == pytest.approx(poses.compose(flange, tool).position, abs=1e-5)


def test_a_step_beyond_the_limit_is_refused_before_anything_moves(emulator, robot, home):
    with pytest.raises(MotionRefusedError, match="mm long"):
        robot.move_linear(shifted(home, dx=0.04), SPEED, timeout_s=60.0)
    with pytest.raises(MotionRefusedError, match="step 2 of 2"):
        robot.check_trajectory([shifted(home, dx=0.02), shifted(home, dx=0.2)], SPEED)
    assert emulator.pose() == home


def test_hold_takes_effect_at_the_end_of_a_piece(emulator, robot, home):
    with moving(robot, shifted(home, dx=0.03), SLOW) as outcome:
        robot.hold()
        assert stands(emulator)
    assert isinstance(outcome[0], MotionInterruptedError)
    assert outcome[0].reached.position == pytest.approx(emulator.pose().position, abs=1e-4)
    assert emulator.pose().position[0] < home.position[0] + 0.02
    assert robot.state().stopped


def test_nothing_moves_after_hold_until_resume_and_resume_moves_nothing(emulator, robot, home):
    robot.hold()
    with pytest.raises(MotionRefusedError, match="resume"):
        robot.move_linear(shifted(home, dx=0.001), SPEED, timeout_s=60.0)
    robot.connect()
    with pytest.raises(MotionRefusedError, match="resume"):
        robot.move_linear(shifted(home, dx=0.001), SPEED, timeout_s=60.0)
    robot.resume()
    assert emulator.pose() == home
    robot.move_linear(shifted(home, dx=0.001), SPEED, timeout_s=60.0)


def test_a_motion_that_takes_too_long_ends_between_two_pieces(emulator, robot, home):
    with pytest.raises(DeviceTimeoutError, match=r"not finished in 0\.3 s; it was stopped"):
        robot.move_linear(shifted(home, dx=0.03), SLOW, timeout_s=0.3)
    assert stands(emulator)
    assert robot.state().stopped


def test_a_server_that_falls_silent_in_a_motion_is_told_with_the_way_out(emulator, home):
    with (
        connected(emulator, reply_timeout_s=1.0) as robot,
        moving(robot, shifted(home, dx=0.03), SLOW) as outcome,
    ):
        emulator.mute = True
    assert isinstance(outcome[0], DeviceTimeoutError)
    assert "Look at the robot" in str(outcome[0])
    with pytest.raises(DeviceUnreachableError, match=r"connect\(\) first"):
        robot.state()


def test_a_late_acknowledgement_never_passes_for_another_answer(emulator, home):
    with connected(emulator, reply_timeout_s=1.0) as robot:
        with moving(robot, shifted(home, dx=0.03), SLOW) as outcome:
            emulator.mute = True
        emulator.mute = False
        assert isinstance(outcome[0], DeviceTimeoutError)
        with pytest.raises(DeviceUnreachableError):
            robot.state()
        robot.connect()  # the server delivers the acknowledgement to this, its next client
        assert robot.state().T_base_tool.position == pytest.approx(emulator.pose().position, abs=5e-5)
        assert robot.state().stopped


def test_a_lost_connection_is_told_and_nothing_moves_on_reconnection(emulator, robot):
    emulator.drop_connection()
    time.sleep(0.05)
    with pytest.raises(DeviceUnreachableError, match="connect again"):
        robot.state()
    before = emulator.pose()
    robot.connect()
    assert emulator.pose() == before
    assert robot.state().ready


def test_standing_elsewhere_than_asked_for_is_a_fault(emulator, robot, home):
    emulator.landing_offset = (0.0, 0.0005, 0.0)
    with pytest.raises(DeviceFaultError, match=r"0\.\d+ mm"):
        robot.move_linear(shifted(home, dx=0.005), SPEED, timeout_s=60.0)


def test_a_target_that_the_controller_cannot_reach_is_a_timeout_that_tells_to_look(emulator, home):
    wide = MotionLimits(joint_limits=((-10.0, 10.0),) * 6, minimum_wrist_angle=0.0, step_length=0.03)
    with connected(emulator, limits=wide, reply_timeout_s=0.3) as robot:
        emulator.landing_offset = (5.0, 0.0, 0.0)
        with pytest.raises(DeviceTimeoutError, match="Look at the robot"):
            robot.move_linear(shifted(home, dx=0.003), SPEED, timeout_s=60.0)


def test_poses_are_read_between_the_pieces_and_while_the_tool_stands(robot, home):
    standing = robot.read(1.0)
    assert len(standing) >= 1
    assert not standing.moving.any()
    robot.move_linear(shifted(home, dx=0.01), SLOW, timeout_s=10.0)
    block = robot.read(1.0)
    assert len(block) >= 5
    assert block.moving.any()
    assert not block.moving[-1]
    assert np.diff(block.counter).tolist() == [1] * (len(block) - 1)
    assert (np.diff(block.device_time_s) > 0).all()
    assert block.position[-1] == pytest.approx(shifted(home, dx=0.01).position, abs=5e-5)
    assert robot.statistics().received == block.counter[-1]


def test_nobody_at_the_address_and_a_busy_server_are_told(emulator, robot):
    with pytest.raises(DeviceTimeoutError, match="carrying out a motion"):
        OpenABB(settings_for(emulator, connect_timeout_s=0.2)).connect()
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        port = unused.getsockname()[1]
        with pytest.raises(DeviceUnreachableError, match=f"127.0.0.1:{port}"):
            OpenABB(OpenABBSettings("127.0.0.1", port)).connect()


def test_a_robot_that_is_not_connected_says_what_to_do():
    robot = OpenABB(OpenABBSettings("127.0.0.1"))
    for call in (robot.state, robot.hold, robot.resume, robot.statistics, lambda: robot.read(0.0)):
        with pytest.raises(DeviceUnreachableError, match=r"connect\(\) first"):
            call()
    robot.close()


@pytest.mark.parametrize("changes", [{"stop_within_s": 0.0}, {"position_decimals": 4}, {"reply_gap_s": -1.0}])
def test_settings_that_cannot_be_right_are_refused(changes):
    with pytest.raises(ConfigurationError):
        OpenABBSettings("127.0.0.1", **changes)
