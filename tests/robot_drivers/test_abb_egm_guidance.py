"""EGM guidance: what the PC commands and when it keeps quiet, and what the emulated controller makes of it."""

import contextlib
import dataclasses
import math
import socket
import threading
import time

import numpy as np
import pytest
from abb_robot_client.egm import EGM

from robot_drivers.abb.egm.codec import (
    EgmCartesian,
    EgmHeader,
    EgmJoints,
    EgmMotion,
    EgmPose,
    EgmQuaternion,
    EgmRobot,
    EgmSensor,
    EgmState,
    decode_sensor,
)
from robot_drivers.abb.egm.guidance import EGMGuidedRobot
from robot_drivers.abb.egm.guidance_session import EGMGuidanceSettings, GuidanceSession
from robot_drivers.abb.egm.position_stream import EGMSample, EGMSettings
from robot_drivers.abb.egm.protobuf import encode
from robot_drivers.abb.emulator.arm import CYCLE_S, Arm
from robot_drivers.abb.emulator.controller import ControllerEmulator
from robot_drivers.abb.emulator.guidance import (
    NO_DATA_FROM_DEVICE,
    Guidance,
    GuidanceMode,
    GuidanceSettings,
    GuidanceState,
)
from robot_drivers.abb.emulator.settings import ArmSettings
from robot_drivers.abb.motion import kinematics
from robot_drivers.errors import (
    DeviceFaultError,
    DeviceTimeoutError,
    DeviceUnreachableError,
    MotionRefusedError,
)
from robot_drivers.motion import poses
from robot_drivers.motion.line_interpolator import LineInterpolator
from robot_drivers.protocols import Pose, Robot, Speed

DOWN = (0.0, 0.0, 1.0, 0.0)
HOME = Pose((0.45, 0.0, 0.35), DOWN)
SPEED = Speed(linear=0.03, angular=0.3)
ENDLESS = GuidanceSettings(comm_timeout_s=20.0, cond_time_s=1e6, position_gain=20.0, max_speed_deviation=50.0)


def shifted(dx=0.0, dy=0.0, dz=0.0):
    x, y, z = HOME.position
    return Pose((x + dx, y + dy, z + dz), DOWN)


# ---------------------------------------------------------------- the reference


def test_the_reference_keeps_speed_and_acceleration_and_ends_on_its_target():
    reference = LineInterpolator(HOME, Speed(linear=0.1, angular=1.0))
    reference.begin(shifted(dx=0.02), SPEED)
    track = [reference.pose.position[0]]
    while not reference.resting:
        track.append(reference.advance(0.004).position[0])
    speed = np.diff(track) / 0.004
    assert speed.max() == pytest.approx(0.03)
    assert np.abs(np.diff(speed) / 0.004)[:-1].max() < 0.1 + 1e-9  # the last step takes what is left
    assert reference.pose == shifted(dx=0.02)


def test_a_braking_reference_rests_on_the_line():
    reference = LineInterpolator(HOME, Speed(linear=0.1, angular=1.0))
    reference.begin(shifted(dx=0.02, dy=0.02), SPEED)
    for _ in range(100):
        reference.advance(0.004)
    reference.brake()
    before = reference.pose.position
    while not reference.resting:
        reference.advance(0.004)
    dx, dy, _ = np.subtract(reference.pose.position, HOME.position)
    assert dx == pytest.approx(dy)
    assert math.dist(before, reference.pose.position) < 0.03**2 / (2 * 0.1) + 1e-3


# ---------------------------------------------------------------- what is answered, and when


def sample_at(pose, time_s):
    joints = kinematics.inverse_continuous(pose, near=(0.0, 0.3, 0.5, 0.0, 0.8, 0.0))
    return EGMSample(0, time_s, pose, joints, joints, host_time_ns=0)


def told(motors=1, mci=3, rapid=2):
    return EgmRobot(motor_state=EgmState(motors), mci_state=EgmState(mci), rapid_exec_state=EgmState(rapid))


def commanded(answer):
    planned = decode_sensor(answer).planned
    p = planned.cartesian.pos
    return (p.x, p.y, p.z)


def test_the_first_answer_is_the_pose_that_was_reported():
    answer = GuidanceSession(EGMGuidanceSettings()).answer(sample_at(shifted(dy=0.01), 1.0), told(), 0)
    sensor = decode_sensor(answer)
    assert sensor.header.mtype == 3
    assert sensor.planned.joints is None
    assert commanded(answer) == pytest.approx((450.0, 10.0, 350.0))


@pytest.mark.parametrize(
    "message", [told(motors=2), told(mci=2), told(mci=1), told(rapid=1), EgmRobot()], ids=str
)
def test_a_controller_that_does_not_follow_gets_no_answer_and_ends_the_motion(message):
    session = GuidanceSession(EGMGuidanceSettings())
    session.answer(sample_at(HOME, 1.0), told(), 0)
    session.begin(shifted(dx=0.01), SPEED)
    assert session.answer(sample_at(HOME, 1.004), message, 0) is None
    assert session.target is None
    assert "ended guidance" in str(session.interruption)


def test_undefined_rapid_state_is_taken_for_running():
    assert GuidanceSession(EGMGuidanceSettings()).answer(sample_at(HOME, 1.0), told(rapid=0), 0) is not None


def test_after_a_new_session_the_reference_begins_where_the_arm_is():
    session = GuidanceSession(EGMGuidanceSettings())
    session.answer(sample_at(HOME, 1.0), told(), 0)
    session.begin(shifted(dx=0.01), SPEED)
    for n in range(50):
        session.answer(sample_at(HOME, 1.0 + 0.004 * n), told(), 0)
    answer = session.answer(sample_at(shifted(dz=0.005), 2.0), told(), 1)
    assert commanded(answer) == pytest.approx((450.0, 0.0, 355.0))
    assert "new session" in str(session.interruption)


def test_an_arm_that_does_not_follow_ends_the_motion():
    session = GuidanceSession(EGMGuidanceSettings(largest_lag=0.004))
    session.answer(sample_at(HOME, 1.0), told(), 0)
    session.begin(shifted(dx=0.015), SPEED)
    for n in range(1, 500):
        answer = session.answer(sample_at(HOME, 1.0 + 0.004 * n), told(), 0)
    assert "trails its reference by 4." in str(session.interruption)
    assert commanded(answer)[0] < 460.0


def test_a_long_gap_does_not_let_the_reference_jump():
    session = GuidanceSession(EGMGuidanceSettings())
    session.answer(sample_at(HOME, 1.0), told(), 0)
    session.begin(shifted(dx=0.015), SPEED)
    answer = session.answer(sample_at(HOME, 3.0), told(), 0)
    assert commanded(answer)[0] == pytest.approx(450.0, abs=0.1)


def test_no_motion_begins_without_guidance():
    with pytest.raises(MotionRefusedError, match="does not run"):
        GuidanceSession(EGMGuidanceSettings()).begin(HOME, SPEED)


# ---------------------------------------------------------------- the guided robot against the emulator


@contextlib.contextmanager
def guided(emulator, settings=ENDLESS, generation="B'"):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    robot = EGMGuidedRobot(
        EGMGuidanceSettings(
            egm=EGMSettings(port, "127.0.0.1", "127.0.0.1"), silence_limit_s=2.0, connect_timeout_s=20.0
        )
    )
    emulator.start_guidance("127.0.0.1", port, settings, generation)
    robot.connect()
    try:
        deadline = time.monotonic() + 30.0
        while not robot.state().ready and time.monotonic() < deadline:
            time.sleep(0.01)
        yield robot
    finally:
        robot.close()


@pytest.fixture
def emulator():
    with ControllerEmulator() as emulator:
        yield emulator


def test_connecting_moves_nothing(emulator):
    with guided(emulator) as robot:
        as_protocol: Robot = robot
        state = as_protocol.state()
        assert (state.ready, state.moving, state.motors_on) == (True, False, True)
        time.sleep(0.2)
        assert poses.distance(emulator.pose(), HOME)[0] < 2e-5


def test_a_guided_motion_arrives(emulator):
    with guided(emulator) as robot:
        robot.read(1.0)
        reached = robot.move_linear(shifted(dx=0.01, dz=-0.005), SPEED, timeout_s=60.0)
        block = robot.read(1.0)
    assert reached.position == pytest.approx(shifted(dx=0.01, dz=-0.005).position, abs=2.5e-4)
    assert emulator.pose().position == pytest.approx(shifted(dx=0.01, dz=-0.005).position, abs=3e-4)
    assert np.diff(block.counter).min() == 1
    assert emulator.guidance.ignored == 0


def test_hold_stops_a_guided_motion_until_resume(emulator):
    with guided(emulator) as robot:
        errors = []

        def move():
            with pytest.raises(DeviceFaultError, match="hold") as caught:
                robot.move_linear(shifted(dx=0.018), Speed(0.005, 0.3), timeout_s=60.0)
            errors.append(caught.value)

        thread = threading.Thread(target=move)
        thread.start()
        time.sleep(0.5)
        robot.hold()
        thread.join()
        assert errors
        with pytest.raises(MotionRefusedError, match="resume"):
            robot.move_linear(HOME, SPEED, timeout_s=60.0)
        robot.resume()
        robot.move_linear(HOME, SPEED, timeout_s=60.0)


def test_a_guided_motion_beyond_a_limit_is_refused(emulator):
    with guided(emulator) as robot, pytest.raises(MotionRefusedError, match="mm long"):
        robot.move_linear(shifted(dx=0.05), SPEED, timeout_s=60.0)
    assert poses.distance(emulator.pose(), HOME)[0] < 2e-5


def test_a_guided_motion_that_takes_too_long_is_stopped(emulator):
    with guided(emulator) as robot:
        with pytest.raises(DeviceTimeoutError):
            robot.move_linear(shifted(dx=0.018), Speed(0.005, 0.3), timeout_s=0.3)
        assert robot.state().stopped
    assert emulator.pose().position[0] < 0.467


def test_silence_of_the_controller_ends_a_guided_motion(emulator):
    with guided(emulator) as robot:
        stopper = threading.Timer(0.3, emulator.stop_egm)
        stopper.start()
        with pytest.raises(DeviceFaultError, match="no datagram came"):
            robot.move_linear(shifted(dx=0.018), Speed(0.005, 0.3), timeout_s=60.0)
        stopper.join()
        assert not robot.state().ready


def test_closing_lets_the_controller_stop_for_want_of_data(emulator):
    with guided(emulator, dataclasses.replace(ENDLESS, comm_timeout_s=0.8)):
        pass
    deadline = time.monotonic() + 30.0
    while emulator.guidance.state is GuidanceState.RUNNING:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert emulator.guidance.event == NO_DATA_FROM_DEVICE


def test_a_controller_without_time_stamps_is_not_guided(emulator):
    with pytest.raises(DeviceFaultError, match=r"6\.06"), guided(emulator, generation="A"):
        pass


def test_no_datagram_is_reported_with_what_to_check():
    robot = EGMGuidedRobot(EGMGuidanceSettings(egm=EGMSettings(0, "127.0.0.1"), connect_timeout_s=0.05))
    with pytest.raises(DeviceUnreachableError, match="UDPUC"):
        robot.connect()


# ---------------------------------------------------------------- the emulated controller


def reference(pose, speed_ref=None):
    x, y, z = np.multiply(pose.position, 1e3)
    cartesian = EgmPose(EgmCartesian(x, y, z), EgmQuaternion(*pose.quaternion_wxyz))
    return encode(EgmSensor(EgmHeader(1, 0, 3), EgmMotion(cartesian=cartesian), speed_ref))


def quiet_arm():
    return Arm(ArmSettings(repeatability_std=0.0, encoder_noise_std=0.0))


def test_a_step_of_the_reference_is_followed_with_the_time_constant_of_the_gain():
    arm = quiet_arm()
    guidance = Guidance(dataclasses.replace(ENDLESS, position_gain=5.0, filter_hz=100.0), arm)
    for _ in range(round(0.2 / CYCLE_S)):
        guidance.cycle(reference(shifted(dx=0.01)))
    remaining = (0.46 - arm.planned.position[0]) / 0.01
    assert remaining == pytest.approx(math.exp(-1), abs=0.02)


def test_a_ramp_is_trailed_by_speed_over_gain():
    arm = quiet_arm()
    guidance = Guidance(dataclasses.replace(ENDLESS, position_gain=5.0, filter_hz=100.0), arm)
    for n in range(500):
        target = shifted(dx=0.01 * n * CYCLE_S)
        guidance.cycle(reference(target))
    assert target.position[0] - arm.planned.position[0] == pytest.approx(0.01 / 5.0, rel=0.03)


def test_no_joint_exceeds_the_allowed_speed_and_all_are_slowed_alike():
    arm = quiet_arm()
    start = arm.joints
    guidance = Guidance(dataclasses.replace(ENDLESS, mode=GuidanceMode.JOINT, max_speed_deviation=2.0), arm)
    target = tuple(
        math.degrees(q) + d for q, d in zip(start, (5.0, 10.0, -20.0, 0.0, 5.0, 40.0), strict=True)
    )
    command = encode(EgmSensor(EgmHeader(1, 0, 3), EgmMotion(joints=EgmJoints(target))))
    for _ in range(100):
        guidance.cycle(command)
    turned = np.degrees(np.subtract(arm.joints, start))
    assert np.abs(turned).max() == pytest.approx(2.0 * 100 * CYCLE_S, rel=0.01)
    assert turned / turned[5] == pytest.approx([0.125, 0.25, -0.5, 0.0, 0.125, 1.0], rel=0.02)


def test_a_session_ends_when_converged_for_the_condition_time():
    guidance = Guidance(GuidanceSettings(cond_time_s=0.1), quiet_arm())
    for _ in range(round(0.1 / CYCLE_S) + 1):
        guidance.cycle(reference(HOME))
    assert guidance.state is GuidanceState.CONVERGED


def test_silence_of_the_pc_fails_with_the_controllers_event():
    guidance = Guidance(GuidanceSettings(comm_timeout_s=0.2, cond_time_s=1e6), quiet_arm())
    guidance.cycle(reference(HOME))
    for _ in range(round(0.2 / CYCLE_S) + 1):
        guidance.cycle(None)
    assert (guidance.state, guidance.event) == (GuidanceState.FAILED, 41822)


@pytest.mark.parametrize(
    "datagram",
    [
        b"rubbish",
        b"",
        reference(Pose((math.nan, 0.0, 0.35), DOWN)),
        reference(Pose(HOME.position, (0.0,) * 4)),
    ],
)
def test_what_is_no_reference_is_ignored(datagram):
    arm = quiet_arm()
    guidance = Guidance(ENDLESS, arm)
    guidance.cycle(datagram)
    assert guidance.ignored == 1
    assert arm.planned.position == pytest.approx(HOME.position, abs=1e-12)


def test_a_reference_beyond_the_reach_fails_and_the_arm_stays_in_range():
    arm = quiet_arm()
    guidance = Guidance(dataclasses.replace(ENDLESS, max_speed_deviation=200.0), arm)
    for _ in range(1000):
        guidance.cycle(reference(Pose((1.2, 0.0, 0.35), DOWN)))
    assert guidance.state is GuidanceState.FAILED
    assert arm.planned.position[0] < 0.85


def test_a_foreign_client_guides_the_tool_and_the_joints():
    client = EGM(port=0)
    port = client.socket.getsockname()[1]
    try:
        with ControllerEmulator() as emulator:
            emulator.start_guidance("127.0.0.1", port, ENDLESS)
            for _ in range(150):
                assert client.receive_from_robot(timeout=20.0)[0]
                client.send_to_robot_cart([455.0, 3.0, 348.0], list(DOWN))
            assert emulator.pose().position == pytest.approx((0.455, 0.003, 0.348), abs=2e-4)
            emulator.start_guidance("127.0.0.1", port, dataclasses.replace(ENDLESS, mode=GuidanceMode.JOINT))
            _, state = client.receive_from_robot(timeout=20.0)
            target = np.add(state.joint_angles, [1.0, -1.0, 1.0, 2.0, 0.5, 3.0])
            for _ in range(150):
                received, state = client.receive_from_robot(timeout=20.0)
                client.send_to_robot(target)
            assert received
            assert state.joint_angles == pytest.approx(target, abs=0.05)
    finally:
        client.close()
