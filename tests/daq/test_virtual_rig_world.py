"""The physics between the emulated devices: each senses the instant that it asks for."""

import math
import multiprocessing
import threading
import time
from collections.abc import Iterator

import pytest

from daq.frames import compose, inverse
from daq.virtual_rig.layout import FRAMES, GRASP_CENTRE, placed_beads
from daq.virtual_rig.physics import world
from daq.virtual_rig.physics.phantom import SpringPhantom
from daq.virtual_rig.physics.world import SimulatedTissue
from robot_drivers.clock import host_time_ns
from robot_drivers.protocols import Pose

SECOND_NS = 1_000_000_000
PHANTOM = SpringPhantom(GRASP_CENTRE, placed_beads(1))


def tool_at(way_m: float) -> Pose:
    """``T_base_tool`` that pulls the phantom by so much along x."""
    x, y, z = GRASP_CENTRE
    gripper = compose(FRAMES.T_base_tissue.pose, Pose((x + way_m, y, z)))
    return compose(gripper, inverse(FRAMES.T_tool_gripper.pose))


@pytest.fixture
def path() -> list[tuple[int, Pose]]:
    """Where the tool was, as the controller tells it; it stood until a second ago."""
    return [(host_time_ns() - SECOND_NS, tool_at(0.0))]


@pytest.fixture
def solved() -> list[Pose]:
    """The poses that the phantom was solved at."""
    return []


@pytest.fixture
def told() -> list[str]:
    """What it says of itself."""
    return []


@pytest.fixture
def tissue(path: list[tuple[int, Pose]], solved: list[Pose], told: list[str]) -> Iterator[SimulatedTissue]:
    ours, theirs = multiprocessing.Pipe()

    def solve() -> None:
        while (pose := theirs.recv()) is not None:
            solved.append(pose)
            theirs.send(PHANTOM.solve(pose))

    solver = threading.Thread(target=solve)
    solver.start()
    tissue = SimulatedTissue(ours, path.copy, FRAMES, told.append)
    yield tissue
    tissue.close()
    ours.send(None)
    solver.join()


def test_between_two_cycles_the_gripper_is_between_their_poses(
    path: list[tuple[int, Pose]], tissue: SimulatedTissue
) -> None:
    begin_ns = path[-1][0]
    path.append((begin_ns + 4_000_000, tool_at(0.0004)))
    wrench, pose = tissue.wrench(begin_ns + 1_000_000)
    assert pose.position[0] - GRASP_CENTRE[0] == pytest.approx(1e-4)
    assert wrench[0] == pytest.approx(-PHANTOM.stiffness[0] * 1e-4)


def test_a_device_that_asks_before_the_controller_has_got_there_waits_for_it(
    path: list[tuple[int, Pose]], tissue: SimulatedTissue
) -> None:
    cycle_ns = host_time_ns() + 60 * SECOND_NS  # what is asked for lies ahead, so that there is time to wait
    path.append((cycle_ns, tool_at(0.0)))
    controller = threading.Timer(0.1, path.append, [(cycle_ns + 4_000_000, tool_at(0.0004))])
    controller.start()
    _, pose = tissue.wrench(cycle_ns + 2_000_000)
    controller.join()
    assert pose.position[0] - GRASP_CENTRE[0] == pytest.approx(2e-4)


def test_a_controller_without_power_leaves_the_gripper_where_it_was(tissue: SimulatedTissue) -> None:
    _, pose = tissue.wrench(host_time_ns() - SECOND_NS // 2)
    assert pose.position == pytest.approx(GRASP_CENTRE)


@pytest.fixture
def late_follower(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a busy computer the thread that follows the gripper may not have looked for long."""
    monkeypatch.setattr(world, "_SAMPLE_S", 60.0)


@pytest.mark.usefixtures("late_follower")
@pytest.mark.parametrize("speed_m_per_s", [0.01, 0.05, 0.2])
def test_a_gripper_has_room_for_as_long_as_it_takes_to_go_too_far(
    path: list[tuple[int, Pose]], tissue: SimulatedTissue, speed_m_per_s: float
) -> None:
    begun_ns = host_time_ns() + 60 * SECOND_NS
    for number in range(4):
        path.append((begun_ns + 4_000_000 * number, tool_at(0.001 + 0.004 * number * speed_m_per_s)))
    ahead_s = (path[-1][0] - host_time_ns()) * 1e-9
    left_m = 2.5e-3 - (0.001 + 0.012 * speed_m_per_s)
    assert tissue.room_s() - ahead_s == pytest.approx(left_m / speed_m_per_s, abs=0.05)


@pytest.mark.usefixtures("late_follower")
def test_a_gripper_far_ahead_is_waited_for_also_where_nobody_has_asked_for_its_pose_yet(
    path: list[tuple[int, Pose]], tissue: SimulatedTissue
) -> None:
    assert tissue.room_s() == math.inf
    path.append((path[-1][0] + 4_000_000, tool_at(0.004)))
    assert tissue.room_s() <= 0.0
    path.append((path[-1][0] + 400_000_000, tool_at(0.004)))
    assert tissue.room_s() == 0.0


@pytest.mark.usefixtures("late_follower")
def test_a_gripper_that_leaps_from_where_it_was_solved_for_does_not_stop_time_for_good(
    path: list[tuple[int, Pose]], tissue: SimulatedTissue
) -> None:
    path.append((path[-1][0], tool_at(-0.1)))
    path.append((path[-1][0] + 4_000_000, tool_at(0.0)))
    assert tissue.room_s() >= 0.004


def test_a_tissue_that_falls_behind_the_gripper_says_so(
    path: list[tuple[int, Pose]],
    solved: list[Pose],
    tissue: SimulatedTissue,
    told: list[str],
) -> None:
    def pull(way_m: float) -> list[str]:
        told.clear()
        path.append((path[-1][0] + 4_000_000, tool_at(way_m)))
        deadline_ns = host_time_ns() + 60 * SECOND_NS
        while solved[-1].position[0] - GRASP_CENTRE[0] < way_m - 1e-9 and host_time_ns() < deadline_ns:
            time.sleep(0.001)
        return told.copy()

    assert pull(0.001) == []
    (fallen_behind,) = pull(0.006)
    assert "5.0 mm behind the gripper" in fallen_behind
    assert pull(0.007) == []
