"""Whole estimations: from records made with other elements than the fit's, and from another engine's solution."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from retraction_cases import (
    REFERENCE_BLOCK,
    SMALL_BLOCK,
    follow,
    recorded,
    straight_pull,
    turning_pull,
    with_rows,
)

from estimator.errors import FitError, InputError
from estimator.experiment import Experiment
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.equilibrium.newton import EquilibriumSolver
from estimator.fem.equilibrium.observation import Observation, observe
from estimator.fit.estimate import estimate
from estimator.fit.result import Estimate
from estimator.forward.meshing import mesh_experiment
from estimator.materials import NeoHookean
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

YOUNGS_MODULUS, POISSON_RATIO = 12e3, 0.46
PATHS = {
    "pull": straight_pull(SMALL_BLOCK, 0.012, 6),
    "twist": turning_pull(SMALL_BLOCK, 0.009, np.radians([25.0, 0.0, 10.0]), 6),
}
Solved = dict[str, tuple[list[GripperPose], list[Observation]]]


@pytest.fixture(scope="module")
def solved() -> Solved:
    """Poses and exact observations, rest included, on cubic elements finer than the fit's quadratic ones."""
    grading = Grading(grasp_m=1e-3, anchor_m=2e-3, largest_m=8e-3, growth=2.5, layers=1)
    problem = mesh_experiment(SMALL_BLOCK, grading, "hex64")
    material = Material(NeoHookean(), YOUNGS_MODULUS, POISSON_RATIO)
    rest = EquilibriumSolver(problem).rest(material)
    result = {}
    for name, poses in PATHS.items():
        states = [rest, *follow(problem, material, poses)]
        result[name] = [state.pose for state in states], [observe(problem, state) for state in states]
    return result


def record(
    solved: Solved, names: Sequence[str], seed: int, rows: int = 4, noise: float = 1.0
) -> list[Experiment]:
    rng = np.random.default_rng(seed)
    return [replace(recorded(SMALL_BLOCK, *solved[name], rng, rows, noise), name=name) for name in names]


@dataclass(frozen=True)
class Fitted:
    """An estimation with what it was made from and what it told of its progress."""

    experiments: list[Experiment]
    fit: Estimate
    told: list[tuple[str, int, int]]


def fitted(experiments: list[Experiment]) -> Fitted:
    told: list[tuple[str, int, int]] = []
    fit = estimate(experiments, lambda stage, done, total: told.append((stage, done, total)))
    return Fitted(experiments, fit, told)


@pytest.fixture(scope="module")
def pull(solved: Solved) -> Fitted:
    return fitted(record(solved, ["pull"], seed=1))


@pytest.fixture(scope="module")
def twist(solved: Solved) -> Fitted:
    return fitted(record(solved, ["twist"], seed=2))


@pytest.fixture(scope="module")
def both(pull: Fitted, twist: Fitted) -> Fitted:
    return fitted([*pull.experiments, *twist.experiments])


def inside(
    fit: Estimate, youngs_modulus: float = YOUNGS_MODULUS, poisson_ratio: float = POISSON_RATIO
) -> bool:
    low, high = fit.youngs_modulus.interval95
    lowest, highest = fit.poisson_ratio.interval95
    return low < youngs_modulus < high and lowest < poisson_ratio < highest


def widths(fit: Estimate) -> FloatArray:
    """Of the intervals of ln E and of ν."""
    low, high = fit.youngs_modulus.interval95
    lowest, highest = fit.poisson_ratio.interval95
    return np.array([np.log(high / low), highest - lowest])


def test_the_truth_lies_within_intervals_that_are_narrow(both: Fitted) -> None:
    assert inside(both.fit)
    assert np.all(widths(both.fit) < [0.05, 0.02])
    assert both.fit.noise_ratio == pytest.approx(1.0, abs=0.05)
    assert both.fit.inflation == max(1.0, both.fit.noise_ratio)


def test_the_solution_of_another_engine_gives_its_own_parameters() -> None:
    """The converged Pull of tests/data/reference, every other step, with noise."""
    file = Path(__file__).resolve().parents[1] / "data" / "reference" / "pull_nu0.49.csv"
    table = np.vstack([np.zeros(51), np.loadtxt(file, delimiter=",", skiprows=1)[1::2]])
    rng = np.random.default_rng(2)
    sensor, poses = REFERENCE_BLOCK.sensor, straight_pull(REFERENCE_BLOCK, 0.02, 5)
    wrench = np.zeros((6, 6))
    wrench[:, 0] = -table[:, 2]
    fiducials = REFERENCE_BLOCK.fiducials_rest + table[:, 3:].reshape(6, 16, 3)
    experiment = with_rows(
        REFERENCE_BLOCK,
        [GripperPose(np.array(REFERENCE_BLOCK.grasp.centre), poses[0].rotation), *poses],
        wrench + np.repeat([sensor.force_std, sensor.torque_std], 3) * rng.normal(size=wrench.shape),
        fiducials + sensor.fiducial_std * rng.normal(size=fiducials.shape),
    )
    fit = estimate([experiment])
    assert inside(fit, 15e3, 0.49)
    assert np.all(widths(fit) < [0.05, 0.02])
    assert fit.noise_ratio == pytest.approx(1.0, abs=0.1)


def test_without_noise_the_truth_comes_back_and_the_data_are_explained(solved: Solved) -> None:
    fit = estimate(record(solved, ["pull"], seed=0, rows=1, noise=0.0))
    assert fit.youngs_modulus.value == pytest.approx(YOUNGS_MODULUS, rel=3e-3)
    assert fit.poisson_ratio.value == pytest.approx(POISSON_RATIO, abs=2e-3)
    assert fit.noise_ratio < 0.1
    assert inside(fit)


def test_better_sensors_give_narrower_intervals_that_still_hold_the_truth(
    solved: Solved, pull: Fitted
) -> None:
    """What the discretisation leaves stays as it is; it is most of what remains of the interval of ν."""
    (better,) = record(solved, ["pull"], seed=3, noise=0.25)
    sensor = better.sensor
    quarter = {f.name: getattr(sensor, f.name) / 4 for f in fields(sensor) if f.name.endswith("_std")}
    fit = estimate([replace(better, sensor=replace(sensor, **quarter))])
    assert inside(fit)
    assert np.all(widths(fit) < widths(pull.fit) / [3.0, 1.5])


def test_more_rows_narrow_the_intervals_but_not_as_if_all_errors_were_noise(
    solved: Solved, pull: Fitted
) -> None:
    """Tare and misplaced beads are the same in all rows."""
    many = estimate(record(solved, ["pull"], seed=4, rows=36))
    assert np.all(widths(many) < widths(pull.fit))
    assert np.all(widths(many) > widths(pull.fit) / 3)


def test_noise_beyond_what_is_stated_widens_the_intervals(solved: Solved, pull: Fitted) -> None:
    doubled = estimate(record(solved, ["pull"], seed=5, noise=2.0))
    assert doubled.noise_ratio == pytest.approx(2.0, rel=0.05)
    assert doubled.inflation == doubled.noise_ratio
    assert inside(doubled)
    assert np.all(widths(doubled) > 1.5 * widths(pull.fit))


def test_a_tare_and_misplaced_beads_are_taken_for_what_they_are(solved: Solved) -> None:
    """Both constant and of two standard deviations of a row, nine of a state's mean."""
    (clean,) = record(solved, ["twist"], seed=6, rows=20)
    rng = np.random.default_rng(7)
    tare = np.repeat([clean.sensor.force_std, clean.sensor.torque_std], 3) * rng.choice([-2.0, 2.0], 6)
    offsets = clean.sensor.fiducial_std * rng.choice([-2.0, 2.0], clean.fiducials_rest.shape)
    fit = estimate([replace(clean, wrench=clean.wrench + tare, fiducials=clean.fiducials + offsets)])
    assert inside(fit)
    assert fit.noise_ratio == pytest.approx(1.0, abs=0.05)


def test_what_was_not_measured_is_done_without(twist: Fitted) -> None:
    """A lost bead, a channel that failed, rows without cameras, a state without any wrench or bead."""
    (whole,) = twist.experiments
    fiducials, wrench = whole.fiducials.copy(), whole.wrench.copy()
    fiducials[:, 4] = np.nan
    fiducials[9:14] = np.nan
    fiducials[::3, 7, 2] = np.nan
    wrench[:, 5] = np.nan
    unseen = whole.step == 3
    fiducials[unseen] = np.nan
    wrench[unseen] = np.nan
    fit = estimate([replace(whole, fiducials=fiducials, wrench=wrench)])
    assert inside(fit)
    assert fit.noise_ratio == pytest.approx(1.0, abs=0.1)
    assert np.all(widths(fit) > widths(twist.fit))
    assert np.isfinite(fit.fits[0].fiducials).all()


def test_experiments_together_determine_more_than_each_alone(
    pull: Fitted, twist: Fitted, both: Fitted
) -> None:
    for alone in (pull, twist):
        assert inside(alone.fit)
        assert np.all(widths(both.fit) < widths(alone.fit))
    assert [fit.experiment.name for fit in both.fit.fits] == ["pull", "twist"]


def test_beads_that_are_seen_anew_at_rest_are_those_of_the_same_mounting(both: Fitted) -> None:
    class MeshingError(Exception):
        """The experiments were taken for those of one mounting."""

    def mesh(experiment: Experiment) -> RetractionProblem:
        raise MeshingError

    first, second = both.experiments
    seen = second.fiducials_rest + np.random.default_rng(1).normal(0.0, 3e-5, second.fiducials_rest.shape)
    with pytest.raises(MeshingError):
        estimate([first, replace(second, fiducials_rest=seen)], mesh=mesh)


def test_experiments_of_different_phantoms_are_refused(both: Fitted) -> None:
    first, second = both.experiments
    for other in (
        replace(second, phantom_id="P02"),
        replace(second, phantom=replace(second.phantom, size_m=(0.04, 0.03, 0.012))),
        replace(second, fiducials_rest=second.fiducials_rest + 1e-3),
    ):
        with pytest.raises(
            InputError, match=r"^twist is not of the same mounting as pull: .* differ; .* one by one"
        ):
            estimate([first, other])
    with pytest.raises(InputError, match="no experiment"):
        estimate([])


def test_a_force_of_the_wrong_sign_is_named_with_what_to_check(pull: Fitted) -> None:
    (experiment,) = pull.experiments
    with pytest.raises(
        FitError, match=r"does not oppose the motion.*check the sign and the axes of fx fy fz"
    ):
        estimate([replace(experiment, wrench=-experiment.wrench)])


def test_progress_is_told_of_every_solved_state(pull: Fitted) -> None:
    assert len(pull.told) == pull.fit.forward_solves
    assert list(dict.fromkeys(stage for stage, _, _ in pull.told)) == [
        "a few states",
        "all states",
        "finer mesh",
    ]
    assert all(1 <= done <= total for _, done, total in pull.told)


def test_an_estimation_costs_few_forward_solutions(both: Fitted) -> None:
    """Each of the fourteen states is solved twice or three times, a few of them more often."""
    assert both.fit.forward_solves < 6 * 14


def test_the_numbers_for_other_programs_keep_their_shape(pull: Fitted) -> None:
    fit, shown = pull.fit, pull.fit.as_json()
    assert list(shown)[:9] == [
        "youngs_modulus",
        "poisson_ratio",
        "correlation",
        "rmse",
        "noise_ratio",
        "iterations",
        "forward_solves",
        "seconds",
        "mesh",
    ]
    assert shown["youngs_modulus"] == {
        "value": fit.youngs_modulus.value,
        "std": fit.youngs_modulus.std,
        "interval95": list(fit.youngs_modulus.interval95),
    }
    assert list(shown["poisson_ratio"]) == ["value", "std", "interval95"]
    assert shown["rmse"]["fiducials"] == pytest.approx(SMALL_BLOCK.sensor.fiducial_std, rel=0.2)
    assert shown["rmse"]["force"] == pytest.approx(SMALL_BLOCK.sensor.force_std, rel=0.3)
    assert shown["mesh"]["kind"] == "hex27"
