"""From the rows of an experiment to the states to be solved, and from one material's solution to the next one's."""

import numpy as np
import pytest
from numpy.typing import NDArray
from retraction_cases import SMALL_BLOCK, recorded, straight_pull, turning_pull, with_rows
from scipy.spatial.transform import Rotation

from estimator.errors import SolverError
from estimator.experiment import Experiment
from estimator.fem.block_mesh import Grading
from estimator.fem.equilibrium import EquilibriumSolver
from estimator.fem.motion import GripperPose
from estimator.fem.observation import Observation
from estimator.forward.meshing import mesh_experiment
from estimator.forward.model import ForwardModel
from estimator.forward.schedule import schedule_poses, spread_states, travel
from estimator.materials import NeoHookean
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

PROBLEM = mesh_experiment(
    SMALL_BLOCK, Grading(grasp_m=5e-3, anchor_m=8e-3, largest_m=15e-3, growth=2.0, layers=1)
)
REST = GripperPose(np.array(SMALL_BLOCK.grasp.centre), Rotation.identity())


def moved(poses: list[GripperPose]) -> Experiment:
    """An experiment along poses, its measurements never looked at."""
    return with_rows(SMALL_BLOCK, poses, np.zeros((len(poses), 6)), np.zeros((len(poses), 9, 3)))


def channels(observation: Observation) -> FloatArray:
    return np.concatenate([observation.wrench, observation.fiducials.reshape(-1)])


def test_rows_whose_poses_agree_within_the_noise_share_a_state_at_their_mean() -> None:
    out = [REST, *straight_pull(SMALL_BLOCK, 0.012, 4)]
    path = [*out, *reversed(out[:-1])]
    nothing = Observation(np.zeros(6), np.zeros((9, 3)), {}, {}, np.zeros((6, 6)), np.zeros((9, 3, 6)), {})
    experiment = recorded(SMALL_BLOCK, path, [nothing] * len(path), np.random.default_rng(1), rows=5)
    schedule = schedule_poses(experiment)
    assert len(schedule.poses) == 5
    np.testing.assert_array_equal(schedule.state_of_row, np.repeat([0, 1, 2, 3, 4, 3, 2, 1, 0], 5))
    np.testing.assert_array_equal(schedule.rows_per_state, [10, 10, 10, 10, 5])
    for pose, exact in zip(schedule.poses, out, strict=True):
        np.testing.assert_allclose(pose.position, exact.position, atol=4 * 3e-5 / np.sqrt(5))


def test_steps_barely_above_the_noise_make_states_of_their_own() -> None:
    """Steps of 0.2 mm, where six standard deviations are 0.18 mm; rotations count by a lever of 10 mm."""
    fine = [REST, *straight_pull(SMALL_BLOCK, 0.004, 20)]
    assert len(schedule_poses(moved(fine)).poses) == 21
    turning = [REST, *turning_pull(SMALL_BLOCK, 0.0, np.array([0.0, 0.0, 0.4]), 8)]
    assert len(schedule_poses(moved(turning)).poses) == 9


def test_states_are_chosen_evenly_along_the_motion_with_the_farthest_among_them() -> None:
    out = [REST, *straight_pull(SMALL_BLOCK, 0.012, 12)]
    schedule = schedule_poses(moved([*out, *reversed(out[:-1])]))
    np.testing.assert_allclose(travel(schedule), np.linspace(0.0, 0.012, 13), atol=1e-12)
    assert spread_states(schedule, 4) == [3, 6, 9, 12]
    assert spread_states(schedule, 1) == [12]
    assert spread_states(schedule, 100) == list(range(13))


def new_model() -> ForwardModel:
    twist = [REST, *turning_pull(SMALL_BLOCK, 0.012, np.array([0.3, 0.0, 0.1]), 3)]
    return ForwardModel(PROBLEM, [moved([REST, *straight_pull(SMALL_BLOCK, 0.012, 3)]), moved(twist)])


@pytest.fixture
def model() -> ForwardModel:
    return new_model()


@pytest.mark.parametrize("before", [(10e3, 0.4), (10e3, 0.0)], ids=["near", "far"])
def test_a_prediction_does_not_depend_on_what_was_predicted_before(
    model: ForwardModel, before: tuple[float, float]
) -> None:
    """From a material near by its fields are carried over; from one far away the motion is followed again."""
    model.predict(Material(NeoHookean(), *before), [[1, 3], [3]])
    selection, material = [[1, 2, 3], [1, 3]], Material(NeoHookean(), 14e3, 0.495)
    found, fresh = model.predict(material, selection), new_model().predict(material, selection)
    assert model.solved_states == 8
    assert [list(observations) for observations in found] == selection
    for one, other in zip(found, fresh, strict=True):
        for state in one:
            np.testing.assert_allclose(channels(one[state]), channels(other[state]), rtol=1e-7, atol=1e-10)
            np.testing.assert_allclose(
                one[state].wrench_by["poisson_ratio"],
                other[state].wrench_by["poisson_ratio"],
                rtol=1e-6,
                atol=1e-8,
            )


def test_a_known_state_is_carried_over_to_another_material_without_following_the_motion_again(
    model: ForwardModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    every = [range(4), range(4)]
    model.predict(Material(NeoHookean(), 10e3, 0.4), every)

    def follow_again(*_: object) -> None:
        raise SolverError("the motion was followed again")

    monkeypatch.setattr(EquilibriumSolver, "solve", follow_again)
    for youngs_modulus, poisson_ratio in ((40e3, 0.45), (40e3, 0.49), (4e3, 0.47)):
        model.predict(Material(NeoHookean(), youngs_modulus, poisson_ratio), every)


def test_the_deformed_mesh_of_a_state_is_the_last_solved_one(model: ForwardModel) -> None:
    model.predict(Material(NeoHookean(), 10e3, 0.4), [[3], []])
    pulled = model.deformed(0, 3)[PROBLEM.gripped]
    np.testing.assert_allclose(pulled, np.broadcast_to([0.012, 0.0, 0.0], pulled.shape), atol=1e-15)
