"""The estimate while a retraction runs."""

from dataclasses import replace

import numpy as np
import pytest
from retraction_cases import COARSE_GRADING, SMALL_BLOCK, follow, recorded, turning_pull

from estimator.errors import InputError
from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.newton import EquilibriumSolver
from estimator.fem.equilibrium.observation import observe
from estimator.fit.estimate import estimate
from estimator.fit.losses import loss_named
from estimator.fit.nuisances import USUAL
from estimator.fit.online import Following, advance, follow_from, renewed, standing_rows
from estimator.fit.settings import FitSettings, material_of
from estimator.forward.meshing import mesh_experiment
from estimator.inference.extrapolation import extrapolated
from estimator.inference.material_parameters import law_parameters
from estimator.materials import NeoHookean

TRUTH = {"youngs_modulus": 12e3, "poisson_ratio": 0.46}


def coarse(experiment: Experiment) -> RetractionProblem:
    return mesh_experiment(experiment, COARSE_GRADING)


@pytest.fixture(scope="module")
def experiment() -> Experiment:
    problem, material = coarse(SMALL_BLOCK), material_of(NeoHookean(), TRUTH)
    poses = turning_pull(SMALL_BLOCK, 0.015, np.radians([20.0, 0.0, 10.0]), 5)
    states = [EquilibriumSolver(problem).rest(material), *follow(problem, material, poses)]
    seen = [observe(problem, state) for state in states]
    return recorded(SMALL_BLOCK, [state.pose for state in states], seen, np.random.default_rng(3))


@pytest.fixture(scope="module")
def followed(experiment: Experiment) -> list[Following]:
    """After each step."""
    reached = [follow_from(experiment, mesh=coarse)]
    for rows in standing_rows(experiment):
        reached.append(advance(renewed(reached[-1]), rows))
    return reached


def test_there_is_an_estimate_as_soon_as_the_gripper_has_moved(followed: list[Following]) -> None:
    assert [following.estimate is not None for following in followed] == [False, False, *[True] * 5]
    last = followed[-1].estimate
    assert last is not None
    assert last.step == 5
    assert last.noise_ratio == pytest.approx(1.0, abs=0.2)


def test_every_step_narrows_the_intervals_and_the_last_ones_hold_the_truth(followed: list[Following]) -> None:
    found = [following.estimate for following in followed if following.estimate is not None]
    for name, truth in TRUTH.items():
        intervals = [one.parameters[name].interval95 for one in found]
        widths = [high - low for low, high in intervals]
        assert widths[-1] < widths[2] < widths[0]
        low, high = intervals[-1]
        assert low < truth < high


def test_in_the_end_it_agrees_with_the_estimation_of_the_whole(
    experiment: Experiment, followed: list[Following]
) -> None:
    settings = FitSettings(nuisances=USUAL - {"discretisation"})
    whole, last = estimate([experiment], settings=settings, mesh=coarse), followed[-1].estimate
    assert last is not None
    for name in TRUTH:
        one, other = whole.parameters[name], last.parameters[name]
        assert other.value == pytest.approx(one.value, abs=0.2 * one.std)
        assert other.std == pytest.approx(one.std, rel=0.15)


def test_a_following_is_a_value(experiment: Experiment, followed: list[Following]) -> None:
    """Advancing an earlier one again gives what it gave, and leaves it as it was."""
    rows = list(standing_rows(experiment))
    before, expected = followed[4], followed[5].estimate
    again = advance(renewed(before), rows[4])
    assert len(before.steps) == 4
    assert again.estimate is not None
    assert expected is not None
    for name in TRUTH:
        assert again.estimate.parameters[name].value == pytest.approx(
            expected.parameters[name].value, rel=1e-6
        )


def test_only_rows_of_a_standing_gripper_count(experiment: Experiment) -> None:
    phases = tuple("ramp" if n % 4 == 0 else "hold" for n in range(len(experiment.time)))
    stays = list(standing_rows(replace(experiment, phase=phases)))
    assert [len(stay.position) for stay in stays] == [3] * 6


def test_a_prediction_at_other_values_is_that_of_their_solution_to_first_order() -> None:
    """The error falls with the square of the change; Young's modulus alone is exact."""
    problem = coarse(SMALL_BLOCK)
    (pose,) = turning_pull(SMALL_BLOCK, 0.012, np.radians([20.0, 0.0, 10.0]), 1)

    def wrench(values: dict[str, float]) -> np.ndarray:
        (state,) = follow(problem, material_of(NeoHookean(), values), [pose])
        return observe(problem, state).wrench

    (state,) = follow(problem, material_of(NeoHookean(), TRUTH), [pose])
    seen, parameters = observe(problem, state), law_parameters(NeoHookean())
    stiffer = {**TRUTH, "youngs_modulus": 30e3}
    np.testing.assert_allclose(
        extrapolated(seen, parameters, TRUTH, stiffer).wrench, wrench(stiffer), rtol=1e-6
    )
    errors = []
    for ratio in (0.44, 0.45):
        other = {"youngs_modulus": 20e3, "poisson_ratio": ratio}
        errors.append(np.abs(extrapolated(seen, parameters, TRUTH, other).wrench - wrench(other)).max())
    assert errors[1] < errors[0] / 2.5


def test_what_only_a_whole_estimation_does_is_refused(experiment: Experiment) -> None:
    for settings in (FitSettings(objective="paper"), FitSettings(loss=loss_named("huber"))):
        with pytest.raises(InputError, match="leave the other choices to the estimation afterwards"):
            follow_from(experiment, settings, coarse)
