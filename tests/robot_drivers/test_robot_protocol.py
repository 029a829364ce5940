"""What every robot does, whatever it is driven by, through the protocol alone: each on its emulator, and a real one.

A further robot joins by a context manager like :func:`irb140_bench` in ``BENCHES``. With ``--hardware RIGFILE`` the
robot of the rig file is tried as well; tests that move it need ``--hardware-motion`` in addition, and a hand on the
stop.
"""

import contextlib
import math
import socket
import threading
import time
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import pytest
from new_threads import new_threads

from robot_drivers.abb.egm.guidance import EGMGuidedRobot
from robot_drivers.abb.egm.guidance_session import EGMGuidanceSettings
from robot_drivers.abb.egm.position_stream import EGMSettings
from robot_drivers.abb.emulator.controller import ControllerEmulator
from robot_drivers.abb.emulator.guidance import GuidanceSettings
from robot_drivers.abb.emulator.open_abb import OpenABBEmulator, OpenABBEmulatorSettings
from robot_drivers.abb.emulator.settings import EmulatorSettings
from robot_drivers.abb.irb140 import IRB140, IRB140Settings
from robot_drivers.abb.motion.limits import MotionLimits
from robot_drivers.abb.open_abb import OpenABB, OpenABBSettings
from robot_drivers.errors import (
    DeviceError,
    DeviceFaultError,
    DeviceTimeoutError,
    DeviceUnreachableError,
    MotionRefusedError,
)
from robot_drivers.protocols import Pose, PoseBlock, Robot, Speed
from robot_drivers.universal_robots import URRobot, URSettings
from robot_drivers.universal_robots.emulator import URControllerEmulator, UREmulatorSettings
from robot_drivers.universal_robots.robot.limits import URLimits

LIMITS = MotionLimits(step_length=0.03)
PATIENCE_S = 20.0  # with an emulated controller on a busy machine
QUICK, SLOW = Speed(0.02, 0.3), Speed(0.005, 0.3)


@dataclass
class Bench:
    """A robot that may move by ``way_m`` along z of the base frame and back.

    Attributes
    ----------
    stop_within_s : the time after which a held robot stands, at the latest
    accuracy_m : of what it reports
    true_pose : where the tool is; None where only the robot itself knows
    may_move : whether tests may move it
    """

    robot: Robot
    stop_within_s: float
    accuracy_m: float
    true_pose: Callable[[], Pose] | None = None
    may_move: bool = True
    way_m: float = 0.01


@contextmanager
def irb140_bench():
    with ControllerEmulator(EmulatorSettings(watchdog_s=PATIENCE_S)) as emulator:
        settings = IRB140Settings(
            "127.0.0.1",
            emulator.command_port,
            emulator.state_port,
            egm=None,
            limits=LIMITS,
            silence_limit_s=PATIENCE_S,
        )
        with contextlib.closing(IRB140(settings)) as robot:
            yield Bench(robot, PATIENCE_S, 1e-4, emulator.pose)


@contextmanager
def open_abb_bench():
    with OpenABBEmulator(OpenABBEmulatorSettings(accept_pause_s=0.01)) as emulator:
        settings = OpenABBSettings(
            "127.0.0.1", emulator.port, limits=LIMITS, stop_within_s=0.2, poll_period_s=0.01, reply_gap_s=0.01
        )
        with contextlib.closing(OpenABB(settings)) as robot:
            yield Bench(robot, PATIENCE_S, 1e-4, emulator.pose)


@contextmanager
def guided_bench():
    """The controller goes on sending when nobody answers, so that a client can come back."""
    patient = GuidanceSettings(
        comm_timeout_s=60.0, cond_time_s=1e6, position_gain=20.0, max_speed_deviation=50.0
    )
    port = free_udp_port()
    settings = EGMGuidanceSettings(
        egm=EGMSettings(port=port, bind_address="127.0.0.1"),
        limits=LIMITS,
        silence_limit_s=PATIENCE_S,
        connect_timeout_s=PATIENCE_S,
    )
    with ControllerEmulator() as emulator:
        emulator.start_guidance("127.0.0.1", port, patient)
        with contextlib.closing(EGMGuidedRobot(settings)) as robot:
            yield Bench(robot, PATIENCE_S, 3e-4, emulator.pose)


def free_udp_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@contextmanager
def ur_bench():
    with URControllerEmulator(UREmulatorSettings(silence_s=PATIENCE_S)) as emulator:
        settings = URSettings(
            "127.0.0.1",
            emulator.port,
            rate_hz=125,
            limits=URLimits(step_length=0.03),
            silence_limit_s=PATIENCE_S,
            connect_timeout_s=PATIENCE_S,
        )
        with contextlib.closing(URRobot(settings)) as robot:
            yield Bench(robot, PATIENCE_S, 3e-4, emulator.pose)


BENCHES = {
    "RAPID server": irb140_bench,
    "open-abb": open_abb_bench,
    "EGM guidance": guided_bench,
    "UR over RTDE": ur_bench,
}


@pytest.fixture(params=[*BENCHES, pytest.param("real", marks=pytest.mark.hardware)])
def bench(request):
    if request.param == "real":
        robot = request.getfixturevalue("hardware")().robot
        with contextlib.closing(robot):
            yield Bench(robot, 1.0, 5e-4, may_move=request.getfixturevalue("may_move"), way_m=0.001)
    else:
        with BENCHES[request.param]() as bench:
            yield bench


@pytest.fixture
def robot(bench):
    bench.robot.connect()
    wait_until(lambda: bench.robot.state().ready)
    return bench.robot


@pytest.fixture
def movable(bench, robot):
    if not bench.may_move:
        pytest.skip("moves a real robot: needs --hardware-motion")
    return bench


def wait_until(condition, timeout_s=60.0):
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.005)


def here(bench):
    """Where the tool is: truly, where something but the robot knows it."""
    return bench.true_pose() if bench.true_pose else bench.robot.state().T_base_tool


def stands(bench):
    before = here(bench)
    time.sleep(0.05)
    return math.dist(before.position, here(bench).position) < bench.accuracy_m / 3


def raised(pose, dz):
    x, y, z = pose.position
    return Pose((x, y, z + dz), pose.quaternion_wxyz)


@contextmanager
def under_way(bench, target):
    """A slow motion in another thread, already begun; gives the list that will hold how it ended."""
    outcome = []

    def move():
        try:
            outcome.append(bench.robot.move_linear(target, SLOW, timeout_s=60.0))
        except DeviceError as error:
            outcome.append(error)

    thread = threading.Thread(target=move)
    thread.start()
    wait_until(lambda: bench.robot.state().moving or outcome)
    try:
        yield outcome
    finally:
        thread.join()


# ---- without motion


def test_the_identity_says_who_the_robot_is(robot):
    identity = robot.identity
    assert identity.kind == "robot"
    assert identity.model
    assert identity.address
    assert identity == robot.identity


def test_a_robot_that_is_not_connected_says_what_to_do(bench):
    for call in (bench.robot.state, bench.robot.hold, bench.robot.statistics, lambda: bench.robot.read(0.0)):
        with pytest.raises(DeviceUnreachableError, match=r"connect\(\) first"):
            call()


def test_connecting_and_connecting_again_moves_nothing(bench):
    if bench.true_pose is None:
        bench.robot.connect()
    before = here(bench)
    bench.robot.connect()
    assert stands(bench)
    bench.robot.connect()
    assert stands(bench)
    assert math.dist(before.position, here(bench).position) < bench.accuracy_m


def test_the_state_is_a_pose_with_six_joints_at_rest(bench, robot):
    state = robot.state()
    assert (state.ready, state.moving, state.stopped, state.motors_on) == (True, False, False, True)
    assert np.linalg.norm(state.T_base_tool.quaternion_wxyz) == pytest.approx(1.0, abs=1e-3)
    assert state.T_base_tool.position == pytest.approx(here(bench).position, abs=bench.accuracy_m)
    assert len(state.joints) == 6
    assert np.isfinite(state.joints).all()


def test_a_block_is_made_of_arrays_of_one_length_and_the_stated_types(robot):
    block = robot.read(1.0)
    n = len(block)
    assert n > 0
    for name, shape, kind in [
        ("counter", (n,), np.int64),
        ("device_time_s", (n,), np.float64),
        ("host_time_ns", (n,), np.int64),
        ("position", (n, 3), np.float64),
        ("quaternion_wxyz", (n, 4), np.float64),
        ("joints", (n, 6), np.float64),
        ("moving", (n,), np.bool_),
    ]:
        array = getattr(block, name)
        assert array.shape == shape
        assert array.dtype == kind


def test_no_state_is_told_twice_and_its_clock_goes_on(robot):
    robot.read(1.0)
    blocks, end = [], time.monotonic() + 0.5
    while time.monotonic() < end:
        blocks.append(robot.read(0.2))
    counters, times, stamps = (
        np.concatenate([getattr(block, name) for block in blocks])
        for name in ("counter", "device_time_s", "host_time_ns")
    )
    assert len(counters) >= 5
    assert (np.diff(counters) >= 1).all()
    assert (np.diff(times) > 0).all()
    assert stamps[-1] - stamps[0] == pytest.approx((times[-1] - times[0]) * 1e9, abs=0.2e9)
    assert not np.concatenate([block.moving for block in blocks]).any()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda pose: raised(pose, 0.5), "mm long"),
        (lambda pose: raised(pose, math.nan), "finite"),
        (lambda pose: Pose(pose.position, (0.0, 0.0, 2.0, 0.0)), "length"),
    ],
)
def test_what_a_limit_forbids_is_refused_before_anything_moves(bench, robot, change, words):
    start = robot.state().T_base_tool
    with pytest.raises(MotionRefusedError, match=words):
        robot.move_linear(change(start), SLOW, timeout_s=60.0)
    assert stands(bench)
    assert robot.state().T_base_tool.position == pytest.approx(start.position, abs=2 * bench.accuracy_m)


def test_a_speed_beyond_the_limit_is_refused(bench, robot):
    start = robot.state().T_base_tool
    for speed in (Speed(10.0, 0.3), Speed(0.0, 0.3), Speed(math.nan, 0.3)):
        with pytest.raises(MotionRefusedError, match="speed"):
            robot.move_linear(raised(start, 0.001), speed, timeout_s=60.0)
    assert stands(bench)


def test_a_whole_trajectory_is_refused_for_one_bad_step(bench, robot):
    start = robot.state().T_base_tool
    robot.check_trajectory([raised(start, 0.001), start], SLOW)
    with pytest.raises(MotionRefusedError, match="step 2 of 3"):
        robot.check_trajectory([raised(start, 0.001), raised(start, 0.5), start], SLOW)
    assert stands(bench)


def test_nothing_moves_after_hold_until_resume_and_resume_moves_nothing(bench, robot):
    robot.hold()
    robot.hold()
    state = robot.state()
    assert state.stopped
    assert not state.ready
    target = raised(state.T_base_tool, 0.001)
    with pytest.raises(MotionRefusedError, match="resume"):
        robot.move_linear(target, SLOW, timeout_s=60.0)
    robot.close()
    robot.connect()
    with pytest.raises(MotionRefusedError, match="resume"):
        robot.move_linear(target, SLOW, timeout_s=60.0)
    robot.resume()
    wait_until(lambda: robot.state().ready)
    assert stands(bench)


def test_closing_twice_and_closing_what_never_connected_is_harmless(bench):
    bench.robot.close()
    bench.robot.connect()
    bench.robot.close()
    bench.robot.close()
    bench.robot.connect()
    assert len(bench.robot.state().joints) == 6


def test_closing_leaves_no_thread_behind(bench):
    new = new_threads()
    bench.robot.connect()
    bench.robot.close()
    assert new() == 0


# ---- with motion


def test_a_motion_returns_the_pose_reached_when_the_tool_stands_there(movable):
    start = movable.robot.state().T_base_tool
    for target in (raised(start, movable.way_m), start):
        reached = movable.robot.move_linear(target, QUICK, timeout_s=60.0)
        assert reached.position == pytest.approx(target.position, abs=movable.accuracy_m)
        assert stands(movable)
        assert here(movable).position == pytest.approx(target.position, abs=2 * movable.accuracy_m)


def test_the_states_tell_the_motion(movable):
    start = movable.robot.state().T_base_tool
    movable.robot.read(1.0)
    movable.robot.move_linear(raised(start, movable.way_m), SLOW, timeout_s=60.0)
    block = movable.robot.read(1.0)
    movable.robot.move_linear(start, QUICK, timeout_s=60.0)
    assert isinstance(block, PoseBlock)
    assert block.moving.any()
    assert (np.diff(block.position[:, 2]) > -2 * movable.accuracy_m).all()
    assert block.position[-1, 2] - start.position[2] == pytest.approx(
        movable.way_m, abs=2 * movable.accuracy_m
    )


def test_hold_stops_a_motion_of_another_thread(movable):
    start = movable.robot.state().T_base_tool
    with under_way(movable, raised(start, movable.way_m)) as outcome:
        began = time.monotonic()
        movable.robot.hold()
        assert time.monotonic() - began < movable.stop_within_s
        assert stands(movable)
    assert isinstance(outcome[0], DeviceFaultError)
    assert here(movable).position[2] < start.position[2] + 0.9 * movable.way_m
    assert movable.robot.state().stopped
    movable.robot.resume()
    movable.robot.move_linear(start, QUICK, timeout_s=60.0)


def test_a_second_motion_is_refused_while_one_is_under_way(movable):
    start = movable.robot.state().T_base_tool
    with (
        under_way(movable, raised(start, movable.way_m)) as outcome,
        pytest.raises(MotionRefusedError, match="another motion"),
    ):
        movable.robot.move_linear(start, QUICK, timeout_s=60.0)
    assert isinstance(outcome[0], Pose)
    movable.robot.move_linear(start, QUICK, timeout_s=60.0)


def test_a_motion_that_takes_too_long_is_stopped_and_the_robot_held(movable):
    start = movable.robot.state().T_base_tool
    with pytest.raises(DeviceTimeoutError, match="stopped"):
        movable.robot.move_linear(raised(start, movable.way_m), SLOW, timeout_s=0.1)
    wait_until(lambda: stands(movable))
    assert movable.robot.state().stopped
    assert here(movable).position[2] < start.position[2] + 0.9 * movable.way_m
    movable.robot.resume()
    movable.robot.move_linear(start, QUICK, timeout_s=60.0)
