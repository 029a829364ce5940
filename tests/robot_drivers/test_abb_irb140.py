"""The IRB 140 driver against an emulated controller: what it does, and above all what it never does."""

import contextlib
import dataclasses
import math
import signal
import socket
import threading

import numpy as np
import pytest
from abb_motions import moving, shifted, stands, wait_until
from new_threads import new_threads

from robot_drivers.abb.egm.position_stream import EGMSettings
from robot_drivers.abb.emulator.controller import ControllerEmulator
from robot_drivers.abb.emulator.settings import ArmSettings, ControllerFaults, EmulatorSettings
from robot_drivers.abb.irb140 import IRB140, IRB140Settings, MotionInterruptedError
from robot_drivers.abb.motion.limits import MotionLimits
from robot_drivers.errors import (
    ConfigurationError,
    DeviceFaultError,
    DeviceTimeoutError,
    DeviceUnreachableError,
    MotionRefusedError,
)
from robot_drivers.motion import poses
from robot_drivers.motion.checks import Box
from robot_drivers.protocols import Pose, Robot, Speed

SPEED = Speed(linear=0.05, angular=0.3)
SLOW = Speed(linear=0.005, angular=0.3)
LIMITS = MotionLimits(step_length=0.03)
PATIENCE_S = 20.0


def settings_for(emulator, **changes):
    basic = IRB140Settings(
        "127.0.0.1",
        emulator.command_port,
        emulator.state_port,
        egm=None,
        limits=LIMITS,
        connect_timeout_s=PATIENCE_S,
        silence_limit_s=PATIENCE_S,
    )
    return dataclasses.replace(basic, **changes)


@contextlib.contextmanager
def connected(emulator, **changes):
    robot = IRB140(settings_for(emulator, **changes))
    robot.connect()
    try:
        yield robot
    finally:
        robot.close()


def raises(kind, call):
    try:
        call()
    except kind:
        return True
    return False


def free_udp_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def emulator():
    """A controller whose watchdog leaves a busy machine its time."""
    with ControllerEmulator(EmulatorSettings(watchdog_s=PATIENCE_S)) as emulator:
        yield emulator


@pytest.fixture
def home(emulator):
    return emulator.pose()


@pytest.fixture
def robot(emulator):
    with connected(emulator) as robot:
        yield robot


def test_it_is_a_robot(robot):
    as_protocol: Robot = robot
    assert as_protocol.identity.model == "ABB IRB 140"
    assert as_protocol.identity.serial == "140-500000"
    assert as_protocol.identity.details["robotware"] == "6.08"


def test_connecting_moves_nothing_and_leaves_the_robot_ready(emulator, robot, home):
    assert stands(emulator)
    assert emulator.pose() == home
    state = robot.state()
    assert (state.ready, state.moving, state.stopped, state.motors_on) == (True, False, False, True)
    assert state.T_base_tool.position == pytest.approx(home.position, abs=5e-5)


def test_a_motion_returns_when_the_tool_stands_there(emulator, robot, home):
    target = shifted(home, dx=0.02, dy=-0.01)
    reached = robot.move_linear(target, SPEED, timeout_s=60.0)
    assert reached.position == pytest.approx(target.position, abs=2e-5)
    assert emulator.pose().position == pytest.approx(target.position, abs=1e-4)
    assert stands(emulator)


def test_a_motion_keeps_its_speed_and_its_line(emulator, robot, home):
    robot.move_linear(shifted(home, dx=0.01, dz=0.01), Speed(linear=0.02, angular=0.3), timeout_s=60.0)
    track = emulator.path()
    times = np.array([time_ns - track[0][0] for time_ns, _ in track]) * 1e-9
    positions = np.array([pose.position for _, pose in track])
    along = (positions - home.position) @ [math.sqrt(0.5), 0.0, math.sqrt(0.5)]
    off_line = (positions - home.position) @ [math.sqrt(0.5), 0.0, -math.sqrt(0.5)]
    assert np.abs(off_line).max() < 1e-4
    middle = (along > 0.004) & (along < 0.010)
    assert np.polyfit(times[middle], along[middle], 1)[0] == pytest.approx(0.02, rel=0.05)


def test_a_turn_is_carried_out_as_well(robot, home):
    turned = Pose(home.position, poses.product(poses.about_z(math.radians(5)), home.quaternion_wxyz))
    reached = robot.move_linear(turned, SPEED, timeout_s=60.0)
    assert max(poses.distance(reached, turned)) < 1e-4


def test_a_step_beyond_the_limit_is_refused_before_anything_moves(emulator, robot, home):
    with pytest.raises(MotionRefusedError, match="mm long"):
        robot.move_linear(shifted(home, dx=0.04), SPEED, timeout_s=60.0)
    assert stands(emulator)


def test_a_whole_trajectory_is_refused_for_one_bad_step(emulator, robot, home):
    targets = [shifted(home, dz=0.02 * n) for n in (1, 2, 3, 5)]
    with pytest.raises(MotionRefusedError, match=r"step 4 of 4 .*40\.0"):
        robot.check_trajectory(targets, SPEED)
    robot.check_trajectory(targets[:3], SPEED)
    assert stands(emulator)


def test_the_controller_refuses_by_itself_what_the_installer_forbids(emulator, home):
    """The driver's limits are wide open here; the controller's are not."""
    wide = MotionLimits(step_length=0.5, workspace=Box((-1.0, -1.0, -1.0), (1.0, 1.0, 1.5)), linear_speed=1.0)
    with connected(emulator, limits=wide) as robot:
        with pytest.raises(MotionRefusedError, match=r"150\.0\d mm is longer than the controller allows"):
            robot.move_linear(shifted(home, dx=0.15), SPEED, timeout_s=60.0)
        with pytest.raises(MotionRefusedError, match="above the controller's cap"):
            robot.move_linear(shifted(home, dx=0.05), Speed(0.5, 0.3), timeout_s=60.0)
    assert emulator.pose() == home


def test_the_controller_also_keeps_the_limits_it_was_handed(emulator, home):
    """A bare client of the same session limits cannot leave the box of the driver."""
    narrow = MotionLimits(workspace=Box((0.44, -0.01, 0.34), (0.46, 0.01, 0.36)))
    with connected(emulator, limits=narrow) as robot, pytest.raises(MotionRefusedError, match="workspace"):
        robot.move_linear(shifted(home, dx=0.015), SPEED, timeout_s=60.0)
    assert emulator.pose() == home


def test_hold_stops_a_motion_of_another_thread_on_its_way(emulator, robot, home):
    with moving(robot, shifted(home, dx=0.02), SLOW) as outcome:
        robot.hold()
        assert stands(emulator)
    assert isinstance(outcome[0], MotionInterruptedError)
    assert "hold()" in str(outcome[0])
    assert outcome[0].reached.position == pytest.approx(emulator.pose().position, abs=1e-4)
    assert robot.state().stopped


def test_nothing_moves_after_hold_until_resume_and_resume_moves_nothing(emulator, robot, home):
    with moving(robot, shifted(home, dx=0.02), SLOW):
        robot.hold()
    with pytest.raises(MotionRefusedError, match="resume"):
        robot.move_linear(home, SPEED, timeout_s=60.0)
    robot.resume()
    assert stands(emulator)
    assert robot.state().ready
    robot.move_linear(home, SPEED, timeout_s=60.0)
    assert emulator.pose().position == pytest.approx(home.position, abs=1e-4)


def test_holding_a_standing_robot_needs_resume_as_well(robot, home):
    robot.hold()
    robot.hold()
    assert not robot.state().ready
    with pytest.raises(MotionRefusedError):
        robot.move_linear(shifted(home, dx=0.001), SPEED, timeout_s=60.0)
    robot.resume()
    robot.move_linear(shifted(home, dx=0.001), SPEED, timeout_s=60.0)


def test_a_hold_outlives_a_reconnection(emulator, robot, home):
    robot.hold()
    robot.connect()
    with pytest.raises(MotionRefusedError, match="resume"):
        robot.move_linear(shifted(home, dx=0.001), SPEED, timeout_s=60.0)
    assert emulator.pose() == home


def test_a_motion_that_takes_too_long_is_stopped(emulator, robot, home):
    with pytest.raises(DeviceTimeoutError, match="stopped"):
        robot.move_linear(shifted(home, dx=0.02), SLOW, timeout_s=0.3)
    assert stands(emulator)
    assert robot.state().stopped


def test_ctrl_c_during_a_motion_stops_it(emulator, robot, home):
    interrupt = threading.Timer(0.3, signal.raise_signal, [signal.SIGINT])
    interrupt.start()
    with pytest.raises(KeyboardInterrupt):
        robot.move_linear(shifted(home, dx=0.02), SLOW, timeout_s=60.0)
    interrupt.join()
    assert stands(emulator)
    assert robot.state().stopped


def test_two_motions_at_once_are_refused(robot, home):
    with moving(robot, shifted(home, dx=0.02), SLOW):
        with pytest.raises(MotionRefusedError, match="under way"):
            robot.move_linear(home, SPEED, timeout_s=60.0)
        robot.hold()


def test_a_lost_connection_stops_the_arm_and_is_not_taken_up_again(emulator, robot, home):
    emulator.inject(ControllerFaults(drop_at_fraction=0.3))
    with pytest.raises(DeviceUnreachableError):
        robot.move_linear(shifted(home, dx=0.02), SLOW, timeout_s=60.0)
    emulator.inject(ControllerFaults())
    wait_until(lambda: stands(emulator))
    stopped_at = emulator.pose()
    assert stopped_at.position[0] < home.position[0] + 0.015
    robot.connect()
    assert stands(emulator)
    assert emulator.pose() == stopped_at
    assert robot.state().stopped
    robot.resume()
    assert stands(emulator)
    robot.move_linear(home, SPEED, timeout_s=60.0)


def test_after_a_loss_every_call_says_so_until_connect(emulator, robot):
    emulator.drop_connections()
    wait_until(lambda: raises(DeviceUnreachableError, robot.state))
    with pytest.raises(DeviceUnreachableError):
        robot.hold()
    robot.connect()
    assert robot.state().motors_on


def test_a_controller_that_falls_silent_is_given_up(emulator, home):
    with connected(emulator, silence_limit_s=0.5) as robot:
        emulator.inject(ControllerFaults(mute=True))
        with pytest.raises(DeviceTimeoutError):
            robot.state()
        wait_until(lambda: raises(DeviceTimeoutError, robot.state))


def test_a_stop_by_the_controller_ends_the_motion_with_its_reason(emulator, robot, home):
    emulator.inject(ControllerFaults(stop_at_fraction=0.5))
    with pytest.raises(MotionInterruptedError, match="stopped its motion program"):
        robot.move_linear(shifted(home, dx=0.01), SPEED, timeout_s=60.0)
    assert stands(emulator)
    with pytest.raises(DeviceFaultError, match="start it on the pendant"):
        robot.resume()
    emulator.inject(ControllerFaults())
    emulator.start_program()
    assert stands(emulator)
    robot.resume()
    robot.move_linear(home, SPEED, timeout_s=60.0)


def test_motors_off_shows_in_the_state_and_forbids_motion(emulator, robot, home):
    emulator.motors_off()
    state = robot.state()
    assert (state.motors_on, state.ready) == (False, False)
    assert "motors are off" in state.message
    with pytest.raises(MotionRefusedError, match="motors are off"):
        robot.move_linear(shifted(home, dx=0.001), SPEED, timeout_s=60.0)


def test_standing_elsewhere_than_asked_for_is_a_fault(emulator, robot, home):
    emulator.inject(ControllerFaults(landing_offset=(0.0, 0.0, 0.0005)))
    with pytest.raises(DeviceFaultError, match=r"0\.(49|50)\d mm"):
        robot.move_linear(shifted(home, dx=0.005), SPEED, timeout_s=60.0)


def test_leaving_the_straight_line_stops_the_motion(emulator, robot, home):
    emulator.inject(ControllerFaults(landing_offset=(0.0, 0.02, 0.0)))
    with pytest.raises(DeviceFaultError, match="off its straight line"):
        robot.move_linear(shifted(home, dx=0.02), SLOW, timeout_s=60.0)
    assert stands(emulator)
    assert robot.state().stopped


def test_the_state_stream_delivers_every_message_once(robot, home):
    robot.read(1.0)
    robot.move_linear(shifted(home, dx=0.01), SPEED, timeout_s=60.0)
    block = robot.read(1.0)
    assert robot.identity.details["pose_source"] == "RAPID state stream"
    assert np.diff(block.counter).tolist() == [1] * (len(block) - 1)
    assert np.diff(block.device_time_s) == pytest.approx(3 * 0.004032, abs=2e-6)
    assert block.moving.any()
    assert not block.moving[-1]
    assert block.position[-1] == pytest.approx(shifted(home, dx=0.01).position, abs=5e-5)
    assert robot.statistics().lost == 0


def test_the_end_of_the_state_stream_is_reported_after_its_last_sample(emulator, robot):
    robot.read(1.0)
    emulator.drop_connections()
    with pytest.raises(DeviceUnreachableError, match="connect again"):
        while True:
            robot.read(0.5)


def test_egm_is_the_pose_source_where_the_controller_streams_it(emulator, home):
    port = free_udp_port()
    emulator.start_egm_stream("127.0.0.1", port)
    with connected(emulator, egm=EGMSettings(port=port)) as robot:
        assert robot.identity.details["pose_source"] == "EGM position stream, layout B'"
        robot.move_linear(shifted(home, dx=0.01), SPEED, timeout_s=60.0)
        block = robot.read(1.0)
    assert len(block) > 50
    assert np.diff(block.device_time_s) == pytest.approx(0.004032, abs=2e-6)
    assert block.moving.any()


def test_without_egm_datagrams_the_state_stream_takes_over(emulator):
    with connected(emulator, egm=EGMSettings(port=free_udp_port()), egm_wait_s=0.05) as robot:
        assert robot.identity.details["pose_source"] == "RAPID state stream"
        assert len(robot.read(1.0)) > 0


def test_an_egm_stream_in_the_wrong_angle_unit_is_refused(emulator):
    port = free_udp_port()
    emulator.start_egm_stream("127.0.0.1", port, "A")
    robot = IRB140(settings_for(emulator, egm=EGMSettings(port=port, untimed_joint_unit="deg")))
    with pytest.raises(ConfigurationError, match="unit of EGM joints"):
        robot.connect()


def test_a_tool_frame_moves_the_tool_not_the_flange():
    tool = Pose((0.0, 0.0, 0.12))
    with ControllerEmulator(EmulatorSettings(arm=ArmSettings(T_flange_tool=tool))) as emulator:
        home = emulator.pose()
        with connected(emulator, T_flange_tool=tool) as robot:
            turned = Pose(home.position, poses.product(poses.about_x(math.radians(8)), home.quaternion_wxyz))
            robot.move_linear(turned, SPEED, timeout_s=60.0)
        assert emulator.pose().position == pytest.approx(home.position, abs=1e-4)


def test_a_tool_that_is_not_the_controllers_is_refused(emulator):
    robot = IRB140(settings_for(emulator, T_flange_tool=Pose((0.0, 0.0, 0.12))))
    with pytest.raises(ConfigurationError, match=r"120\.0 mm and 0\.0° from where T_flange_tool"):
        robot.connect()


def test_nobody_at_the_address_is_reported_with_the_address():
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        port = unused.getsockname()[1]
        with pytest.raises(DeviceUnreachableError, match=f"127.0.0.1:{port}"):
            IRB140(IRB140Settings("127.0.0.1", command_port=port, egm=None)).connect()


def test_a_second_client_is_not_served_while_the_first_is_there(emulator, robot, home):
    second = IRB140(settings_for(emulator, silence_limit_s=0.3))
    with pytest.raises(DeviceTimeoutError, match="another client"):
        second.connect()
    robot.move_linear(shifted(home, dx=0.001), SPEED, timeout_s=60.0)


def test_a_robot_that_is_not_connected_says_what_to_do():
    robot = IRB140(IRB140Settings("127.0.0.1"))
    for call in (robot.state, robot.hold, robot.resume, robot.statistics, lambda: robot.read(0.0)):
        with pytest.raises(DeviceUnreachableError, match=r"connect\(\) first"):
            call()
    robot.close()


def test_a_slow_controller_is_waited_for():
    with ControllerEmulator(EmulatorSettings(start_delay_s=0.3)) as emulator, connected(emulator) as robot:
        assert robot.state().ready


def test_closing_leaves_no_thread_behind(emulator):
    new = new_threads()
    with connected(emulator):
        assert new() > 0
    assert new() == 0
