"""From the rows of an experiment to the states to be solved, and from one material's solution to the next one's."""

import numpy as np
import pytest
from numpy.typing import NDArray
from retraction_cases import SMALL_BLOCK, recorded, straight_pull, turning_pull, with_rows
from scipy.spatial.transform import Rotation

from estimator.errors import SolverError
from estimator.experiment import Experiment
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.equilibrium.newton import EquilibriumSolver
from estimator.fem.equilibrium.observation import Observation, observe
from estimator.forward.meshing import mesh_experiment
from estimator.forward.model import ForwardModel
from estimator.forward.schedule import schedule_poses, spread_states, travel
from estimator.forward.solution import Solution, between
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


def test_another_modulus_scales_the_forces_of_known_states_without_solving_them_again(
    model: ForwardModel,
) -> None:
    selection = [[1, 3], []]
    model.predict(Material(NeoHookean(), 10e3, 0.45), selection)
    stiffer = Material(NeoHookean(), 37e3, 0.45)
    (scaled, _), (fresh, _) = model.predict(stiffer, selection), new_model().predict(stiffer, selection)
    assert model.solved_states == 2
    for state in (1, 3):
        np.testing.assert_allclose(channels(scaled[state]), channels(fresh[state]), rtol=1e-7, atol=1e-10)
        for name, slope in scaled[state].wrench_by.items():
            np.testing.assert_allclose(slope, fresh[state].wrench_by[name], rtol=1e-6, atol=1e-10)
        np.testing.assert_allclose(
            scaled[state].wrench_by_pose, fresh[state].wrench_by_pose, rtol=1e-6, atol=1e-6
        )


@pytest.mark.parametrize("kind", ["pull", "twist"])
def test_a_state_on_the_way_between_two_solved_ones_is_found_from_them(kind: str) -> None:
    """The cubic between them misses it by less than a hundredth of what separates it from the nearer one."""
    turn = np.array([0.3, 0.0, 0.1]) if kind == "twist" else np.zeros(3)
    poses = turning_pull(SMALL_BLOCK, 0.012, turn, 4)
    solver, material = EquilibriumSolver(PROBLEM), Material(NeoHookean(), 10e3, 0.48)
    states = [solver.rest(material)]
    for pose in poses:
        states.append(solver.solve(pose, material, states[-1]))
    kept = [Solution.of(state, solver.settings, observe(PROBLEM, state)) for state in states]
    guess = between(PROBLEM, kept[2], kept[4], poses[2])
    assert guess is not None
    exact, loose = states[3].displacement, ~PROBLEM.gripped
    missed = np.linalg.norm((guess.displacement - exact)[loose])
    assert missed < 0.01 * np.linalg.norm((states[2].displacement - exact)[loose])
    found = solver.refine(poses[2], material, guess.displacement, guess.pressure)
    np.testing.assert_allclose(found.displacement, exact, atol=1e-9)


def test_a_pose_elsewhere_than_between_two_solved_ones_is_not_guessed_from_them() -> None:
    poses = straight_pull(SMALL_BLOCK, 0.012, 4)
    solver, material = EquilibriumSolver(PROBLEM), Material(NeoHookean(), 10e3, 0.48)
    first = solver.solve(poses[0], material, solver.rest(material))
    second = solver.solve(poses[1], material, first)
    one, other = (Solution.of(s, solver.settings, observe(PROBLEM, s)) for s in (first, second))
    aside = GripperPose(poses[0].position + np.array([0.0015, 0.004, 0.0]), poses[0].rotation)
    for pose in (REST, poses[2], aside):
        assert between(PROBLEM, one, other, pose) is None
