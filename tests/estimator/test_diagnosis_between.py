"""Load steps between solved poses: what they answer follows from the states on both sides."""

from dataclasses import replace

import numpy as np
import pytest
from effect_cases import there_and_back
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.diagnosis.fitting.case import perturbed
from estimator.diagnosis.model.between import chord_between, spread_between
from estimator.diagnosis.model.free_parameters import free_parameters
from estimator.diagnosis.model.grip_load import GripLoad
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.setup import Setup
from estimator.diagnosis.model.solution import Mechanics, at_few_poses, mechanics_of, solve_case
from estimator.diagnosis.sensitivity.perturbation import Perturbation
from estimator.diagnosis.sensitivity.readings import channels, derivatives, predicted_readings
from estimator.diagnosis.settings import DiagnosisSettings, SolverSettings
from estimator.effects.catalogue import CATALOGUE
from estimator.effects.effect import Effect
from estimator.fem.discretisation.block_mesh import Grading
from estimator.forward.meshing import mesh_experiment

FloatArray = NDArray[np.float64]

COARSE = Grading(grasp_m=6e-3, anchor_m=10e-3, largest_m=30e-3, growth=3.0, layers=1)
MOTION = there_and_back(turn_rad=(0.0, 0.0, 0.2))
ROWS = len(MOTION.time)
EXACT = DiagnosisSettings(solver=SolverSettings(tangent_reuse=0.0))
SETUP = Setup(
    [MOTION.experiment],
    mesh_experiment(MOTION.experiment, COARSE),
    [GripLoad(MOTION.load, MOTION.load / 1e4)],
    settings=EXACT,
)
BASE = Hypothesis(1e4, 0.45)
NOISE = np.concatenate([[0.02] * 3, [5e-4] * 3, [5e-5] * 48])
ZERO = [np.zeros((ROWS, 6 + 48))]


def named(name: str) -> Effect:
    return next(one for one in CATALOGUE if one.name == name)


def with_usual(name: str, share: float) -> Hypothesis:
    """The hypothesis with a share of an effect's usual size."""
    effect = named(name)
    constants = {
        one.name: one.grid[0] if one.grid else (one.lower + one.upper) / 2 for one in effect.constants
    }
    return BASE.with_effect(
        effect, {**constants, **{one.name: share * one.scale for one in effect.amplitudes}}
    )


def solved(hypothesis: Hypothesis, every: int, setup: Setup = SETUP) -> Mechanics:
    return mechanics_of(solve_case(setup, hypothesis, every=every)[0])


def read(mechanics: Mechanics, hypothesis: Hypothesis) -> FloatArray:
    """All channels in units of the sensors' noise."""
    return np.asarray(channels(predicted_readings(mechanics, hypothesis, ZERO[0])) / NOISE)


@pytest.mark.parametrize(
    "hypothesis",
    [
        BASE,
        Hypothesis(1e4, 0.49),
        with_usual("inhomogeneity:cylinder", 0.7),
        with_usual("strain_stiffening:yeoh2", 0.5),
        with_usual("anisotropy:tension_only", 0.5),
        with_usual("gripper_compliance:translation", 0.5),
        with_usual("robot_backlash:translation_taken_up", 0.5),
        with_usual("anchor_compliance:isotropic", 0.5),
    ],
    ids=lambda one: f"{one.poisson_ratio} {[effect.name for effect in one.effects]}",
)
def test_what_lies_between_solved_poses_is_what_solving_it_gives(hypothesis: Hypothesis) -> None:
    every, few = solved(hypothesis, 1), solved(hypothesis, 4)
    assert len(few.solution.states) < len({id(state) for state in every.solution.states})
    assert np.abs(read(few, hypothesis) - read(every, hypothesis)).max() < 0.05


@pytest.mark.parametrize(
    "name", ["inhomogeneity:cylinder", "strain_stiffening:yeoh2", "anchor_compliance:isotropic"]
)
def test_so_are_its_derivatives(name: str) -> None:
    hypothesis = with_usual(name, 0.5)
    steps: list[Perturbation] = [perturbed(hypothesis, one) for one in free_parameters(hypothesis)]
    every, few = (derivatives([solved(hypothesis, n)], hypothesis, steps, ZERO)[0] for n in (1, 4))
    size = np.linalg.norm(every / NOISE[:, None], axis=(0, 1))
    assert (np.linalg.norm((few - every) / NOISE[:, None], axis=(0, 1)) < 0.01 * size).all()


@pytest.mark.parametrize("name", ["inhomogeneity:cylinder", "prestretch:along"])
def test_the_states_of_a_few_poses_tell_what_an_effect_does_as_well_as_all(name: str) -> None:
    every, null = solved(BASE, 1), with_usual(name, 0.0)
    steps = [perturbed(null, one) for one in free_parameters(null) if one.effect == 0]
    few = at_few_poses(every, 4, EXACT.solver.smooth_m)
    assert few.solution.between is not None
    assert len(few.solution.states) == len(few.solution.between.solved) < len(every.solution.states) / 2
    whole, told = (derivatives([one], BASE, steps, ZERO)[0] for one in (every, few))
    size = np.linalg.norm(whole / NOISE[:, None], axis=(0, 1))
    assert (np.linalg.norm((told - whole) / NOISE[:, None], axis=(0, 1)) <= 0.01 * size).all()


def test_poses_around_a_kink_are_solved_themselves() -> None:
    never_smooth = replace(SETUP, settings=DiagnosisSettings(solver=SolverSettings(smooth_m=0.0)))
    (solution,) = solve_case(never_smooth, BASE, every=4)
    assert solution.between is not None
    assert len(solution.between.rest) == 0
    (every,) = solve_case(SETUP, BASE)
    assert read(mechanics_of(solution), BASE) == pytest.approx(read(mechanics_of(every), BASE), abs=2e-3)


@pytest.mark.parametrize("name", ["viscoelasticity:one_term", "stress_softening:damage", "permanent_set"])
def test_where_tissue_remembers_every_load_step_is_solved(name: str) -> None:
    hypothesis = with_usual(name, 0.3)
    (solution,) = solve_case(SETUP, hypothesis, every=4)
    assert solution.between is None
    assert len(solution.states) == len(solution.load_steps)


def test_what_remembers_is_not_followed_past_poses_that_are_not_solved() -> None:
    remembering = with_usual("stress_softening:damage", 0.0)
    parameter, *_ = (one for one in free_parameters(remembering) if one.effect == 0)
    step = perturbed(remembering, parameter)
    with pytest.raises(ValueError, match="every load step"):
        derivatives([solved(BASE, 4)], BASE, [step], ZERO)


def test_a_pose_where_the_gripper_turns_back_is_solved() -> None:
    between = spread_between(MOTION, 7)
    assert between is not None
    assert 20 in between.solved
    assert between.chord(between.rest).holds.all()


@pytest.mark.parametrize("rows", [2, 3, 5, 8, 12, 21])
def test_of_a_short_motion_enough_is_solved_to_tell_a_kink(rows: int) -> None:
    way = MOTION.moved(MOTION.position[:rows], MOTION.rotation[:rows])
    between = spread_between(way, 4)
    assert between is not None
    assert len(between.solved) >= min(rows, 5)


def test_a_gripper_that_stands_has_nothing_between_its_poses() -> None:
    still = MOTION.moved(np.tile(MOTION.position[:1], (ROWS, 1)), Rotation.identity(ROWS))
    assert spread_between(still, 4) is None


@given(
    st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4),
    st.lists(st.floats(-1.0, 1.0), min_size=5, max_size=5),
    st.integers(1, 19),
)
def test_an_answer_that_is_cubic_along_the_way_and_linear_aside_is_met_exactly(
    along: list[float], aside: list[float], at: int
) -> None:
    first, last = np.array([0]), np.array([20])
    position = MOTION.position.copy()
    position[at, 1] += 5e-4
    motion = MOTION.moved(position, Rotation.identity(ROWS))
    chord = chord_between(motion, first, last, np.array([at]))
    assert chord.holds.all()

    def answer(load_step: int) -> tuple[FloatArray, FloatArray]:
        x, *others = 50.0 * (motion.position[load_step] - motion.position[0]), 0.0, 0.0, 0.0
        powers = x[0] ** np.arange(4)
        slopes = np.arange(4) * x[0] ** np.maximum(np.arange(4) - 1, 0)
        rest = np.array([*x[1:], *others])
        by_pose = np.concatenate([[50.0 * slopes @ along], np.array([50.0] * 2 + [1.0] * 3) * aside])
        return np.array([powers @ along + rest @ aside]), by_pose[None]

    assert chord.cubic(0, answer(0), answer(20)) == pytest.approx(answer(at)[0], abs=1e-9)
