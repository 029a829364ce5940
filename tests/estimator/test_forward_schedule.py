"""Which rows share a state, for any size of the pose's noise."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from retraction_cases import SMALL_BLOCK, straight_pull, with_rows
from scipy.spatial.transform import Rotation

from estimator.experiment import Experiment
from estimator.fem.boundary.motion import GripperPose
from estimator.forward.schedule import PoseSchedule, schedule_poses

STEP_M, ROWS = 1e-3, 4
REST = GripperPose(np.array(SMALL_BLOCK.grasp.centre), Rotation.identity())
OUT = [REST, *straight_pull(SMALL_BLOCK, 10 * STEP_M, 10)]
PATH = [*OUT, *reversed(OUT[:-1])]
TRUE_POSE = np.repeat([*range(11), *reversed(range(10))], ROWS)


def reported(noise_m: float, stated_m: float, seed: int) -> Experiment:
    """Steps of a millimetre out and back, four rows at each, as they are reported."""
    poses = [pose for pose in PATH for _ in range(ROWS)]
    exact = with_rows(SMALL_BLOCK, poses, np.zeros((len(poses), 6)), np.zeros((len(poses), 9, 3)))
    noise = np.random.default_rng(seed).normal(0.0, noise_m, exact.position.shape)
    sensor = replace(exact.sensor, position_std=stated_m)
    return replace(exact, position=exact.position + noise, sensor=sensor)


def rows_in_states_of_several_poses(schedule: PoseSchedule) -> int:
    return sum(
        np.count_nonzero(schedule.state_of_row == state)
        for state in range(len(schedule.poses))
        if len(np.unique(TRUE_POSE[schedule.state_of_row == state])) > 1
    )


@settings(max_examples=20)
@given(st.integers(0, 10_000))
def test_noise_well_below_the_steps_leaves_a_state_for_each_pose(seed: int) -> None:
    schedule = schedule_poses(reported(0.03e-3, 0.03e-3, seed))
    assert rows_in_states_of_several_poses(schedule) == 0
    assert 11 <= len(schedule.poses) <= 25  # of two poses beside which a reading stands, each row is one


@pytest.mark.parametrize("share_of_step", [0.15, 0.25, 0.4, 1.0])
def test_poses_that_noise_mixes_up_are_not_taken_for_one(share_of_step: float) -> None:
    noise_m = share_of_step * STEP_M
    mixed = [
        rows_in_states_of_several_poses(schedule_poses(reported(noise_m, noise_m, seed)))
        for seed in range(10)
    ]
    assert np.mean(mixed) < 0.06 * len(TRUE_POSE)


@pytest.mark.parametrize("times", [1.0, 3.0, 10.0])
def test_noise_that_is_stated_too_large_parts_no_poses_and_joins_none(times: float) -> None:
    schedule = schedule_poses(reported(1e-6, 0.1 * times * STEP_M, 1))
    np.testing.assert_array_equal(schedule.state_of_row, TRUE_POSE)


@settings(max_examples=20)
@given(st.floats(0.0, 2.0), st.integers(0, 1000))
def test_states_are_numbered_by_their_first_rows(share_of_step: float, seed: int) -> None:
    schedule = schedule_poses(reported(share_of_step * STEP_M, share_of_step * STEP_M, seed))
    _, first = np.unique(schedule.state_of_row, return_index=True)
    assert (np.diff(first) > 0).all()
    assert schedule.rows_per_state.sum() == len(TRUE_POSE)
    assert len(schedule.poses) == schedule.state_of_row.max() + 1


def test_a_motion_in_thousands_of_rows_is_followed_in_steps_of_the_noise() -> None:
    poses = [REST, *straight_pull(SMALL_BLOCK, 10 * STEP_M, 3000)]
    exact = with_rows(SMALL_BLOCK, poses, np.zeros((len(poses), 6)), np.zeros((len(poses), 9, 3)))
    schedule = schedule_poses(replace(exact, sensor=replace(exact.sensor, position_std=0.03e-3)))
    assert 30 < len(schedule.poses) < 80
