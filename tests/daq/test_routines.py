import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from daq.errors import TrajectoryError
from daq.frames import distance
from daq.trajectories import PULL, Dwell, Trajectory, experiment_kind, lay_out
from daq.trajectories.own import load_function, read_table
from daq.trajectories.routines import (
    NAMED,
    PIECE_M,
    PIECE_RAD,
    lift,
    relaxation,
    repeated,
    sway,
    tap,
    tare_poses,
)
from robot_drivers.ati.compensation.gravity import SMALLEST_SPREAD, gravity_in_sensor
from robot_drivers.protocols import Pose


def measured(trajectory: Trajectory) -> list[Pose]:
    return [step.T_rest_gripper for step in trajectory.steps if step.measure_s > 0]


@pytest.mark.parametrize("name", NAMED)
def test_every_named_trajectory_begins_and_ends_at_rest(name: str) -> None:
    steps = NAMED[name]().steps
    for step in (steps[0], steps[-1]):
        length, angle = distance(Pose((0.0, 0.0, 0.0)), step.T_rest_gripper)
        assert length < 1e-12
        assert angle < 1e-9
    numbers = [step.number for step in steps]
    assert numbers == sorted(numbers)


@pytest.mark.parametrize("name", sorted(set(NAMED) - {"pull", "gradual_tangent_pull", "twist_and_pull"}))
def test_long_ways_are_cut_into_pieces(name: str) -> None:
    steps = NAMED[name]().steps
    for before, after in pairwise(steps):
        length, angle = distance(before.T_rest_gripper, after.T_rest_gripper)
        assert length <= PIECE_M + 1e-9
        assert angle <= PIECE_RAD + 1e-9


def test_a_lift_measures_at_every_height_and_comes_down() -> None:
    heights = [pose.position[2] for pose in measured(lift(0.006, steps=3))]
    assert heights == pytest.approx([0.0, 0.002, 0.004, 0.006, 0.0])


def test_a_relaxation_is_measured_at_the_asked_times_after_arrival() -> None:
    trajectory = relaxation(0.01, holds_s=(1.0, 4.0), measure_s=0.5)
    away = [step for step in trajectory.steps if step.T_rest_gripper.position[0] > 0.0099]
    begins = np.cumsum([0.0] + [step.measure_s for step in away[:-1]]) + np.cumsum(
        [step.settle_s for step in away]
    )
    assert begins.tolist() == pytest.approx([0.0, 1.0, 4.0])
    with pytest.raises(TrajectoryError, match=r"hold at 1\.2 s"):
        relaxation(holds_s=(1.0, 1.2))


def test_tare_poses_turn_gravity_far_enough_to_find_the_tool() -> None:
    quaternions = [pose.quaternion_wxyz for pose in measured(tare_poses())]
    directions = gravity_in_sensor(quaternions) / 9.80665
    spread = np.sqrt(np.sort(np.linalg.eigvalsh(np.cov(directions.T, bias=True) * len(directions))))
    assert spread[1] > 2 * SMALLEST_SPREAD


def test_sway_and_tap_pass_through_and_measure_only_at_rest() -> None:
    for trajectory in (sway(), tap()):
        assert [pose.position for pose in measured(trajectory)] == [(0.0, 0.0, 0.0)] * 2
    pauses = [step.settle_s for step in tap().steps[1:-1]]
    assert len(set(pauses)) == len(pauses)


def test_a_repeated_trajectory_goes_round_and_numbers_on() -> None:
    twice = repeated(PULL.trajectory(), 2)
    assert [step.number for step in twice.steps] == list(range(31))
    assert twice.steps[16].T_rest_gripper == twice.steps[1].T_rest_gripper
    with pytest.raises(TrajectoryError, match="let it return to rest"):
        repeated(lay_out("out", lambda share: Pose((share, 0.0, 0.0)), 2, 0), 2)


def test_the_experiment_format_knows_the_standard_kinds_only() -> None:
    assert experiment_kind("pull") == "pull"
    assert experiment_kind("relaxation") == "other"


def test_a_table_gives_positions_turns_and_times(tmp_path: Path) -> None:
    path = tmp_path / "mine.csv"
    path.write_text(
        "x_m,y_m,z_m,rz_rad,measure_s,phase\n0.001,0,0,,,\n0.002,0,0.001,0.5,1.5,hold\n0,0,0,0,0,return_hold\n"
    )
    trajectory = read_table(path, dwell=Dwell(rest_s=1.0, settle_s=0.2, measure_s=0.7))
    assert trajectory.kind == "mine"
    rest, first, second, back = trajectory.steps
    assert (rest.number, rest.measure_s) == (0, 1.0)
    assert (first.settle_s, first.measure_s) == (0.2, 0.7)
    assert second.T_rest_gripper.position == (0.002, 0.0, 0.001)
    assert second.T_rest_gripper.quaternion_wxyz == pytest.approx((math.cos(0.25), 0, 0, math.sin(0.25)))
    assert (back.phase, back.measure_s) == ("return_hold", 0.0)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("x_m,y_m,z_m\n", "no row below its header"),
        ("x_m,y_m\n0,0\n", "line 1: column z_m is missing"),
        ("x_m,y_m,z_m,w\n0,0,0,0\n", "line 1: column w is unknown"),
        ("x_m,y_m,z_m\n0,0,0\n0,zero,0\n", "line 3, column y_m: 'zero' is no finite number"),
        ("x_m,y_m,z_m,phase\n0,0,0,back\n", "line 2, column phase: 'back'"),
        ("x_m,y_m,z_m,settle_s\n0,0,0,-1\n", "line 2: settle_s and measure_s"),
    ],
)
def test_a_wrong_table_is_told_with_its_line(tmp_path: Path, text: str, told: str) -> None:
    path = tmp_path / "mine.csv"
    path.write_text(text)
    with pytest.raises(TrajectoryError, match=told):
        read_table(path)


def test_a_python_function_is_sampled_along_its_way(tmp_path: Path) -> None:
    path = tmp_path / "mine.py"
    path.write_text(
        "from robot_drivers.protocols import Pose\n\n\n"
        "def arc(share):\n    return Pose((0.01 * share, 0.0, 0.002 * share))\n"
    )
    trajectory = lay_out("arc", load_function(path, "arc"), steps=4, return_steps=1)
    assert [step.T_rest_gripper.position[0] for step in trajectory.steps] == pytest.approx(
        [0.0, 0.0025, 0.005, 0.0075, 0.01, 0.0]
    )
    with pytest.raises(TrajectoryError, match="circle is no function"):
        load_function(path, "circle")
    with pytest.raises(TrajectoryError, match="is no Python file"):
        load_function(tmp_path / "none.py", "arc")
