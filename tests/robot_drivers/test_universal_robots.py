"""What befalls an e-Series arm: whatever goes wrong, nothing moves that was not asked to."""

import contextlib
import math
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import files

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_drivers.errors import (
    ConfigurationError,
    DeviceError,
    DeviceFaultError,
    DeviceProtocolError,
    DeviceTimeoutError,
    DeviceUnreachableError,
    MotionRefusedError,
)
from robot_drivers.motion import poses
from robot_drivers.motion.checks import Box
from robot_drivers.protocols import Pose, Speed
from robot_drivers.universal_robots import URRobot, URSettings, URWrench, URWrenchSettings
from robot_drivers.universal_robots.arms import FULL_TURN, LENGTHS, Arm
from robot_drivers.universal_robots.emulator import URControllerEmulator, UREmulatorSettings, URFaults
from robot_drivers.universal_robots.robot.kinematics import continued, flange_matrix, flange_pose
from robot_drivers.universal_robots.robot.limits import URLimits, check_path
from robot_drivers.universal_robots.robot.registers import PROGRAM_VERSION, pose_of, vector_of

PATIENCE_S = 20.0
HOME = UREmulatorSettings().home
SLOW, QUICK = Speed(0.005, 0.3), Speed(0.03, 0.3)


@contextmanager
def rig(
    emulator: UREmulatorSettings | None = None, **settings: object
) -> Iterator[tuple[URControllerEmulator, URRobot]]:
    patient = emulator or UREmulatorSettings(silence_s=PATIENCE_S)
    with URControllerEmulator(patient) as controller:
        given_settings = {
            "rate_hz": 125.0,
            "silence_limit_s": PATIENCE_S,
            "connect_timeout_s": PATIENCE_S,
        } | settings
        with contextlib.closing(URRobot(URSettings("127.0.0.1", controller.port, **given_settings))) as robot:
            yield controller, robot


def raised(pose: Pose, dz: float) -> Pose:
    x, y, z = pose.position
    return Pose((x, y, z + dz), pose.quaternion_wxyz)


def wait_until(condition, timeout_s=PATIENCE_S):
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.005)


def stands(controller: URControllerEmulator) -> bool:
    before = controller.pose()
    time.sleep(0.1)
    return math.dist(before.position, controller.pose().position) < 1e-5


@contextmanager
def under_way(controller: URControllerEmulator, robot: URRobot, dz: float = 0.015) -> Iterator[list[object]]:
    """A slow motion in another thread that has begun; gives the list that will hold how it ended."""
    start, outcome = controller.pose(), []

    def move() -> None:
        try:
            outcome.append(robot.move_linear(raised(start, dz), SLOW, timeout_s=60.0))
        except DeviceError as error:
            outcome.append(error)

    thread = threading.Thread(target=move)
    thread.start()
    wait_until(lambda: outcome or math.dist(controller.pose().position, start.position) > 1e-4)
    try:
        yield outcome
    finally:
        thread.join()


# ---- the arm


# Computed with ur-analytic-ik 0.1.0.post3 at (0.1, -1.2, 1.5, -0.7, 0.4, 0.9).
REFERENCE = {
    "UR3e": (-0.33485955, -0.25056166, 0.25119731),
    "UR5e": (-0.57775442, -0.28413637, 0.36598781),
    "UR10e": (-0.8241328, -0.36560214, 0.49014103),
}
TURN = [
    [0.85239461, -0.45081446, -0.26493348],
    [-0.15775698, 0.26134114, -0.95226758],
    [0.49853401, 0.85350286, 0.15164665],
]


@pytest.mark.parametrize("arm", REFERENCE)
def test_the_flange_is_where_another_implementation_has_it(arm: Arm):
    T = flange_matrix(LENGTHS[arm], (0.1, -1.2, 1.5, -0.7, 0.4, 0.9))
    np.testing.assert_allclose(T[:3, 3], REFERENCE[arm], atol=1e-8)
    np.testing.assert_allclose(T[:3, :3], TURN, atol=1e-8)


@given(st.sampled_from(sorted(LENGTHS)), st.tuples(*[st.floats(-0.02, 0.02)] * 6))
def test_joints_are_found_again_from_the_pose_that_they_give(arm, change):
    wanted = tuple(a + b for a, b in zip(HOME, change, strict=True))
    found = continued(LENGTHS[arm], flange_pose(LENGTHS[arm], wanted), near=HOME)
    assert found == pytest.approx(wanted, abs=1e-5)


@given(st.tuples(*[st.floats(-2.0, 2.0)] * 3), st.tuples(*[st.floats(-1.7, 1.7)] * 3))
def test_a_pose_in_the_controller_s_form_is_the_same_pose(position, rotation):
    pose = pose_of((*position, *rotation))
    assert vector_of(pose) == pytest.approx((*position, *rotation), abs=1e-9)


HERE = flange_pose(LENGTHS["UR5e"], HOME)


def checked(limits: URLimits, *targets: Pose, speed: Speed = SLOW) -> None:
    check_path(limits, LENGTHS["UR5e"], (HERE, HOME), targets, speed)


@pytest.mark.parametrize(
    ("limits", "target", "words"),
    [
        (
            URLimits(workspace=Box((-1.0, -1.0, 0.0), (1.0, 1.0, HERE.position[2] + 0.005))),
            raised(HERE, 0.01),
            "z = ",
        ),
        (
            URLimits(joint_limits=((-FULL_TURN, FULL_TURN), (-1.5709, -1.5707), *[(-7.0, 7.0)] * 4)),
            raised(HERE, -0.01),
            "axis",
        ),
        (URLimits(joint_speed=0.001), raised(HERE, 0.01), "singularity"),
        (URLimits(), raised(HERE, 0.03), "30.00 mm long"),
        (
            URLimits(),
            Pose(HERE.position, poses.product(poses.about_z(0.5), HERE.quaternion_wxyz)),
            "turns by",
        ),
    ],
)
def test_a_limit_on_the_way_is_told_with_the_step(limits, target, words):
    with pytest.raises(MotionRefusedError, match=f"step 1 of 1 refused, nothing has moved: .*{words}"):
        checked(limits, target)


def test_a_way_out_of_reach_is_refused():
    far = [raised(HERE, 0.02 * step) for step in range(1, 40)]
    with pytest.raises(MotionRefusedError, match="nothing has moved"):
        checked(URLimits(workspace=Box((-2.0, -2.0, 0.0), (2.0, 2.0, 2.0))), *far)


@pytest.mark.parametrize("settings", [{"rate_hz": 0.0}, {"rate_hz": 1000.0}, {"silence_limit_s": 0.0}])
def test_settings_that_cannot_be_are_refused(settings):
    for kind in (URSettings, URWrenchSettings):
        with pytest.raises(ConfigurationError, match=next(iter(settings))):
            kind("127.0.0.1", **settings)


# ---- what goes wrong


def test_the_identity_tells_the_controller_s_software():
    with rig() as (_, robot):
        robot.connect()
        assert robot.identity.details["software"] == "5.14.6.1"


def test_nobody_at_the_address_says_what_to_look_at():
    with pytest.raises(DeviceUnreachableError, match="RTDE is enabled"):
        URRobot(URSettings("127.0.0.1", 9, connect_timeout_s=1.0)).connect()


def test_a_second_driver_of_the_same_arm_is_refused_and_the_first_goes_on():
    with rig() as (controller, robot):
        robot.connect()
        other = URRobot(URSettings("127.0.0.1", controller.port, connect_timeout_s=PATIENCE_S))
        with pytest.raises(DeviceProtocolError, match="written by another client"):
            other.connect()
        assert len(robot.read(PATIENCE_S))


def test_a_tool_other_than_the_rig_file_says_is_refused():
    tool = Pose((0.0, 0.0, 0.1))
    with (
        rig(UREmulatorSettings(T_flange_tool=tool)) as (_, robot),
        pytest.raises(ConfigurationError, match=r"100\.00 mm"),
    ):
        robot.connect()


def test_with_a_tool_the_path_is_that_of_the_tool():
    tool = Pose((0.0, 0.05, 0.1), poses.about_z(0.3))
    with rig(UREmulatorSettings(T_flange_tool=tool, silence_s=PATIENCE_S), T_flange_tool=tool) as (
        controller,
        robot,
    ):
        robot.connect()
        start = controller.pose()
        reached = robot.move_linear(raised(start, 0.004), QUICK, timeout_s=60.0)
        assert reached.position == pytest.approx(raised(start, 0.004).position, abs=2e-4)


@pytest.mark.parametrize(
    ("faults", "words"),
    [
        (URFaults(program_stopped=True), "start retract_servo.script"),
        (URFaults(powered_off=True), "switch it on"),
        (URFaults(protective_stop=True), "unlock it"),
    ],
)
def test_an_arm_that_would_not_follow_is_not_moved_and_says_why(faults, words):
    with rig() as (controller, robot):
        controller.inject(faults)
        robot.connect()
        state = robot.state()
        assert not state.ready
        assert words in state.message
        with pytest.raises(MotionRefusedError, match=words):
            robot.move_linear(raised(state.T_base_tool, 0.005), SLOW, timeout_s=10.0)
        assert stands(controller)


@pytest.mark.parametrize(
    ("faults", "words"),
    [
        (URFaults(program_stopped=True), "start retract_servo.script"),
        (URFaults(protective_stop=True), "unlock it"),
        (URFaults(stuck=True), "trails its reference"),
        (URFaults(slip=0.004), "stopped on its way|off its straight line"),
    ],
)
def test_what_goes_wrong_on_the_way_ends_the_motion_and_nothing_goes_on_afterwards(faults, words):
    # the slip is across the way: the arm moves along x
    with rig(largest_lag=0.006) as (controller, robot):
        robot.connect()
        start, outcome = controller.pose(), []
        x, y, z = start.position

        def move() -> None:
            try:
                outcome.append(robot.move_linear(Pose((x + 0.015, y, z), start.quaternion_wxyz), SLOW, 60.0))
            except DeviceError as error:
                outcome.append(error)

        thread = threading.Thread(target=move)
        thread.start()
        wait_until(lambda: outcome or math.dist(controller.pose().position, start.position) > 1e-4)
        controller.inject(faults)
        thread.join()
        assert isinstance(outcome[0], DeviceFaultError)
        with pytest.raises(DeviceFaultError, match=words):
            raise outcome[0]
        controller.inject(URFaults())
        wait_until(lambda: robot.state().ready)
        assert stands(controller)


@pytest.mark.parametrize("faults", [URFaults(mute=True), URFaults(unplug_at_s=0.0, unplug_for_s=60.0)])
def test_a_controller_that_falls_silent_ends_the_motion_with_an_error_and_the_arm_brakes(faults):
    with rig(UREmulatorSettings(silence_s=1.5), silence_limit_s=1.5) as (controller, robot):
        robot.connect()
        with under_way(controller, robot) as outcome:
            controller.inject(faults)
        assert isinstance(outcome[0], DeviceTimeoutError)
        wait_until(lambda: stands(controller))
        with pytest.raises(DeviceTimeoutError, match="connect again"):
            robot.state()


def test_an_arm_whose_driver_is_gone_brakes_by_itself_and_stays_when_another_connects():
    with rig(UREmulatorSettings(silence_s=1.0)) as (controller, robot):
        robot.connect()
        with under_way(controller, robot) as outcome:
            robot.close()
        assert isinstance(outcome[0], DeviceError)
        wait_until(lambda: stands(controller))
        before = controller.pose()
        robot.connect()
        assert stands(controller)
        assert math.dist(before.position, controller.pose().position) < 1e-5
        assert robot.state().ready


def test_a_controller_that_was_switched_off_is_found_again_and_nothing_moves():
    with rig() as (controller, robot):
        robot.connect()
        before = controller.pose()
        controller.inject(URFaults(restart_at_s=0.0, restart_for_s=0.3))
        with pytest.raises(DeviceUnreachableError, match="connect again"):
            while True:
                robot.read(1.0)
        wait_until(lambda: connects(robot))
        assert stands(controller)
        assert math.dist(before.position, controller.pose().position) < 1e-5


def connects(robot: URRobot) -> bool:
    try:
        robot.connect()
    except DeviceError:
        return False
    return True


@pytest.mark.parametrize(
    ("faults", "count"),
    [(URFaults(loss=0.2), "lost"), (URFaults(rubbish=0.2), "malformed"), (URFaults(cut=0.2), "malformed")],
)
def test_samples_that_go_amiss_are_counted_and_the_others_are_right(faults, count):
    load = (1.0, -2.0, 3.0, 0.1, -0.2, 0.3)
    with URControllerEmulator(UREmulatorSettings(noise_std=(0.0,) * 6), wrench=lambda _: load) as controller:
        controller.inject(faults)
        sensor = URWrench(URWrenchSettings("127.0.0.1", controller.port, silence_limit_s=PATIENCE_S))
        with contextlib.closing(sensor):
            sensor.connect()
            sensor.start()
            wait_until(lambda: sensor.statistics().received > 100)
            block = sensor.read(1.0)
            counts = sensor.statistics()
    assert getattr(counts, count) > 0
    assert (np.diff(block.counter) >= 1).all()
    np.testing.assert_array_equal(block.wrench, np.tile(load, (len(block), 1)))


def test_a_sensor_beyond_its_range_is_not_usable():
    with URControllerEmulator(wrench=lambda _: (0.0, 0.0, 51.0, 0.0, 0.0, 0.0)) as controller:
        sensor = URWrench(URWrenchSettings("127.0.0.1", controller.port, silence_limit_s=PATIENCE_S))
        with contextlib.closing(sensor):
            sensor.connect()
            sensor.start()
            assert not sensor.read(PATIENCE_S).usable.any()


def test_the_script_and_the_driver_are_of_one_version():
    script = (
        files("robot_drivers.universal_robots").joinpath("script/retract_servo.script").read_text("utf-8")
    )
    assert f"local VERSION = {PROGRAM_VERSION}\n" in script
