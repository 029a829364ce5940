"""Whole estimations from synthetic records made with other elements than the fit's, and from another engine's solution."""

from collections.abc import Sequence
from dataclasses import replace
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
)

from estimator.errors import FitError, InputError
from estimator.experiment import Experiment
from estimator.fem.block_mesh import Grading
from estimator.fem.equilibrium import EquilibriumSolver
from estimator.fem.motion import GripperPose
from estimator.fem.observation import Observation, observe
from estimator.fit.estimate import estimate
from estimator.fit.result import Estimate
from estimator.forward.meshing import mesh_experiment
from estimator.materials import NeoHookean
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

YOUNGS_MODULUS, POISSON_RATIO = 12e3, 0.46
PATHS = {
    "pull": straight_pull(SMALL_BLOCK, 0.008, 6),
    "twist": turning_pull(SMALL_BLOCK, 0.006, np.radians([25.0, 0.0, 10.0]), 6),
}
Solved = dict[str, tuple[list[GripperPose], list[Observation]]]


@pytest.fixture(scope="module")
def solved() -> Solved:
    """Poses and exact observations, rest included, on cubic elements finer than the fit's quadratic ones."""
    grading = Grading(grasp_m=0.7e-3, anchor_m=1.5e-3, largest_m=6e-3, growth=2.0, layers=1)
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


def inside(
    fit: Estimate, youngs_modulus: float = YOUNGS_MODULUS, poisson_ratio: float = POISSON_RATIO
) -> bool:
    low, high = fit.youngs_modulus.interval95
    lowest, highest = fit.poisson_ratio.interval95
    return low < youngs_modulus < high and lowest < poisson_ratio < highest


def width(fit: Estimate) -> tuple[float, float]:
    """Of the intervals, of E relative."""
    low, high = fit.youngs_modulus.interval95
    lowest, highest = fit.poisson_ratio.interval95
    return (high - low) / fit.youngs_modulus.value, highest - lowest


def test_the_truth_lies_within_intervals_that_are_narrow(solved: Solved) -> None:
    fit = estimate(record(solved, ["pull", "twist"], seed=1))
    assert inside(fit)
    assert width(fit) < (0.03, 0.02)
    assert fit.noise_ratio == pytest.approx(1.0, abs=0.05)
    assert fit.inflation == max(1.0, fit.noise_ratio)


@pytest.mark.parametrize("poisson_ratio", [0.35, 0.49])
def test_the_solution_of_another_engine_gives_its_own_parameters(poisson_ratio: float) -> None:
    """The converged Pull of tests/data/reference, with noise."""
    file = Path(__file__).resolve().parents[1] / "data" / "reference" / f"pull_nu{poisson_ratio}.csv"
    table = np.vstack([np.zeros(51), np.loadtxt(file, delimiter=",", skiprows=1)])
    rng = np.random.default_rng(2)
    sensor = REFERENCE_BLOCK.sensor
    rows = len(table)
    wrench = np.zeros((rows, 6))
    wrench[:, 0] = -table[:, 2]
    displacement = table[:, 3:].reshape(rows, 16, 3)
    experiment = replace(
        REFERENCE_BLOCK,
        time=np.arange(rows, dtype=float),
        phase=("hold",) * rows,
        step=np.arange(rows),
        position=np.array(REFERENCE_BLOCK.grasp.centre) + table[:, 1:2] * [1.0, 0.0, 0.0],
        quaternion_wxyz=np.tile([1.0, 0.0, 0.0, 0.0], (rows, 1)),
        wrench=wrench + np.repeat([sensor.force_std, sensor.torque_std], 3) * rng.normal(size=(rows, 6)),
        fiducials=REFERENCE_BLOCK.fiducials_rest
        + displacement
        + sensor.fiducial_std * rng.normal(size=displacement.shape),
    )
    fit = estimate([experiment])
    assert inside(fit, 15e3, poisson_ratio)
    assert width(fit) < (0.03, 0.03)


def test_without_noise_the_truth_comes_back_and_the_data_are_explained(solved: Solved) -> None:
    fit = estimate(record(solved, ["pull"], seed=0, rows=1, noise=0.0))
    assert fit.youngs_modulus.value == pytest.approx(YOUNGS_MODULUS, rel=3e-3)
    assert fit.poisson_ratio.value == pytest.approx(POISSON_RATIO, abs=2e-3)
    assert fit.noise_ratio < 0.1
    assert inside(fit)


def test_better_sensors_give_narrower_intervals_that_still_hold_the_truth(solved: Solved) -> None:
    (coarse,) = record(solved, ["pull"], seed=3)
    sensor = coarse.sensor
    finer_sensor = replace(
        sensor,
        force_std=sensor.force_std / 4,
        torque_std=sensor.torque_std / 4,
        fiducial_std=sensor.fiducial_std / 4,
        position_std=sensor.position_std / 4,
    )
    (fine,) = record(solved, ["pull"], seed=3, noise=0.25)
    wide, narrow = estimate([coarse]), estimate([replace(fine, sensor=finer_sensor)])
    assert inside(wide)
    assert inside(narrow)
    assert width(narrow)[0] < width(wide)[0] / 3
    assert width(narrow)[1] < width(wide)[1] / 3


def test_more_rows_narrow_the_intervals_but_not_below_what_tare_and_bead_offsets_leave(
    solved: Solved,
) -> None:
    few, many = (estimate(record(solved, ["pull"], seed=4, rows=rows)) for rows in (1, 16))
    assert width(few)[1] / 4 < width(many)[1] < width(few)[1]


def test_noise_beyond_what_is_stated_widens_the_intervals_as_much(solved: Solved) -> None:
    stated, doubled = (
        estimate(record(solved, ["pull"], seed=5, rows=6, noise=noise)) for noise in (1.0, 2.0)
    )
    assert doubled.noise_ratio == pytest.approx(2.0, rel=0.05)
    assert width(doubled)[1] == pytest.approx(2 * width(stated)[1], rel=0.1)
    assert inside(doubled)


def test_a_tare_and_misplaced_beads_are_taken_for_what_they_are(solved: Solved) -> None:
    """Both constant and of two standard deviations of a row, nine of a state's mean."""
    (clean,) = record(solved, ["twist"], seed=6, rows=20)
    rng = np.random.default_rng(7)
    tare = np.repeat([clean.sensor.force_std, clean.sensor.torque_std], 3) * rng.choice([-2.0, 2.0], 6)
    offsets = clean.sensor.fiducial_std * rng.choice([-2.0, 2.0], clean.fiducials_rest.shape)
    shifted = replace(clean, wrench=clean.wrench + tare, fiducials=clean.fiducials + offsets)
    fit = estimate([shifted])
    assert inside(fit)
    assert fit.noise_ratio == pytest.approx(1.0, abs=0.05)


def test_what_was_not_measured_is_done_without(solved: Solved) -> None:
    """A lost bead, a channel that failed, rows without camera, a state without any wrench or bead."""
    (whole,) = record(solved, ["twist"], seed=8)
    fiducials, wrench = whole.fiducials.copy(), whole.wrench.copy()
    fiducials[:, 4] = np.nan
    fiducials[9:14] = np.nan
    fiducials[::3, 7, 2] = np.nan
    wrench[:, 5] = np.nan
    of_state = whole.step == 3
    fiducials[of_state] = wrench[of_state] = np.nan
    full, partial = estimate([whole]), estimate([replace(whole, fiducials=fiducials, wrench=wrench)])
    assert inside(full)
    assert inside(partial)
    assert partial.noise_ratio == pytest.approx(1.0, abs=0.1)
    assert width(partial) > width(full)
    assert np.isfinite(partial.fits[0].fiducials).all()


def test_experiments_together_determine_more_than_each_alone(solved: Solved) -> None:
    both = record(solved, ["pull", "twist"], seed=9)
    together, *alone = (estimate(chosen) for chosen in (both, both[:1], both[1:]))
    assert all(width(together) < width(fit) for fit in alone)
    assert len(together.fits) == 2


def test_experiments_of_different_phantoms_are_refused(solved: Solved) -> None:
    pull, twist = record(solved, ["pull", "twist"], seed=10)
    for other in (
        replace(twist, phantom_id="P02"),
        replace(twist, phantom=replace(twist.phantom, size_m=(0.04, 0.03, 0.012))),
        replace(twist, fiducials_rest=twist.fiducials_rest + 1e-3),
    ):
        with pytest.raises(
            InputError, match=r"^twist is not of the same mounting as pull .* estimate them one by one"
        ):
            estimate([pull, other])
    with pytest.raises(InputError, match="no experiment"):
        estimate([])


def test_a_force_of_the_wrong_sign_is_named_with_what_to_check(solved: Solved) -> None:
    (pull,) = record(solved, ["pull"], seed=11)
    with pytest.raises(
        FitError, match=r"does not oppose the motion.*check the sign and the axes of fx fy fz"
    ):
        estimate([replace(pull, wrench=-pull.wrench)])


def test_progress_is_told_of_every_solved_state(solved: Solved) -> None:
    told: list[tuple[str, int, int]] = []
    fit = estimate(
        record(solved, ["pull"], seed=12), lambda stage, done, total: told.append((stage, done, total))
    )
    assert len(told) == fit.forward_solves
    assert {stage for stage, _, _ in told} == {"a few states", "all states", "finer mesh"}
    assert all(1 <= done <= total for _, done, total in told)


def test_the_numbers_for_other_programs_keep_their_shape(solved: Solved) -> None:
    fit = estimate(record(solved, ["pull"], seed=13))
    shown = fit.as_json()
    assert list(shown) == [
        "youngs_modulus",
        "poisson_ratio",
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
    assert shown["rmse"]["fiducials"] == pytest.approx(SMALL_BLOCK.sensor.fiducial_std, rel=0.2)
    assert shown["rmse"]["force"] == pytest.approx(SMALL_BLOCK.sensor.force_std, rel=0.3)
    assert shown["mesh"]["kind"] == "hex27"
