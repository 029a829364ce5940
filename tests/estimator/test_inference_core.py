"""What fit, online estimate and diagnosis share: parameters, steps, iteration, whitening, mesh correction."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from retraction_cases import SMALL_BLOCK, straight_pull, with_rows

from estimator.errors import SolverError
from estimator.forward.schedule import schedule_poses, travel
from estimator.inference.discretisation import Course, change_along, smooth, straight
from estimator.inference.free_parameter import (
    IDENTITY,
    LOGARITHM,
    FreeParameter,
    NormalPrior,
    RangePrior,
    Transform,
    in_units_of,
)
from estimator.inference.gauss_newton import Rule, iterate, newton_step
from estimator.inference.linear_model import objective
from estimator.inference.material_parameters import POISSON_RATIO, YOUNGS_MODULUS
from estimator.inference.whitening import Whitening, inverse_root

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Line:
    """A model that is linear in one parameter: its misfit is ``aim`` less that, times a slope."""

    free_parameters: Sequence[FreeParameter]
    residual: tuple[FloatArray, ...]
    jacobian: tuple[FloatArray, ...]


def line(parameter: FreeParameter, aim: float, slope: float, of_jacobian: float = 1.0) -> Line:
    """``of_jacobian`` is the share of the true derivative that the model states."""
    misfit = np.array([slope * (aim - parameter.value)])
    return Line([parameter], (misfit,), (np.array([[of_jacobian * slope]]),))


@pytest.mark.parametrize(
    "transform",
    [IDENTITY, LOGARITHM, in_units_of(0.05), YOUNGS_MODULUS.transform, POISSON_RATIO.transform],
    ids=["identity", "logarithm", "unit", "modulus", "ratio"],
)
@given(value=st.floats(0.01, 0.4999))
def test_a_transform_comes_back_and_knows_its_slope(transform: Transform, value: float) -> None:
    internal = transform.internal_of(value)
    assert transform.value_of(internal) == pytest.approx(value, rel=1e-9)
    step = 1e-6
    quotient = (transform.value_of(internal + step) - transform.value_of(internal - step)) / (2 * step)
    assert transform.slope(value) == pytest.approx(quotient, rel=1e-5)


@given(value=st.floats(1.0, 1e9), step=st.floats(-1e6, 1e6))
def test_a_step_never_leaves_the_bounds_however_long(value: float, step: float) -> None:
    there = YOUNGS_MODULUS.at(value).after(step)
    assert YOUNGS_MODULUS.lower <= there.value <= YOUNGS_MODULUS.upper
    low, high = there.limits
    assert low <= 0.0 <= high


@given(
    aim=st.floats(-5.0, 5.0), slope=st.floats(0.1, 10.0), mean=st.floats(-5.0, 5.0), std=st.floats(0.1, 10.0)
)
def test_a_step_goes_to_the_mean_of_measurement_and_prior_by_their_information(
    aim: float, slope: float, mean: float, std: float
) -> None:
    parameter = FreeParameter(name="size", value=0.7, prior=NormalPrior(mean, std))
    found = newton_step(line(parameter, aim, slope))
    expected = (slope**2 * aim + mean / std**2) / (slope**2 + 1 / std**2)
    assert parameter.after(float(found.step[0])).value == pytest.approx(expected, abs=1e-9)
    assert found.covariance[0, 0] == pytest.approx(1 / (slope**2 + 1 / std**2))
    after = objective(line(parameter.after(float(found.step[0])), aim, slope))
    assert found.promised == pytest.approx(objective(line(parameter, aim, slope)) - after, abs=1e-8)


def test_a_range_holds_a_step_back_and_pulls_nowhere() -> None:
    held, free = (
        newton_step(line(FreeParameter(name="place", value=2.0, prior=prior), 3.0, 1.0))
        for prior in (RangePrior(1.0), None)
    )
    assert 0.0 < held.step[0] < free.step[0] == pytest.approx(1.0)
    there = newton_step(line(FreeParameter(name="place", value=2.0, prior=RangePrior(1.0)), 2.0, 1.0))
    assert there.step[0] == 0.0


@pytest.mark.parametrize(("longest", "upper", "step"), [(0.5, 9.0, 0.5), (9.0, 0.25, 0.25), (9.0, 9.0, 3.0)])
def test_a_step_goes_no_farther_than_trust_and_bounds(longest: float, upper: float, step: float) -> None:
    parameter = FreeParameter(name="size", value=0.0, upper=upper, longest_step=longest)
    assert newton_step(line(parameter, 3.0, 1.0)).step[0] == pytest.approx(step)


RULE = Rule(worthwhile=1e-6)
AT_REST = FreeParameter(name="size", value=0.0)


def solve(of_jacobian: float, solvable_to: float = np.inf) -> Callable[[Line, FloatArray], Line]:
    def stepped(at: Line, step: FloatArray) -> Line:
        there = at.free_parameters[0].after(float(step[0]))
        if there.value > solvable_to:
            raise SolverError("no equilibrium")
        return line(there, 1.0, 10.0, of_jacobian)

    return stepped


def test_an_iteration_tells_why_it_ended() -> None:
    def ended(of_jacobian: float, evaluations: int) -> str:
        start = line(AT_REST, 1.0, 10.0, of_jacobian)
        return iterate(start, solve(of_jacobian), RULE, evaluations).ended

    assert ended(of_jacobian=1.0, evaluations=5) == "converged"
    assert ended(of_jacobian=2.0, evaluations=3) == "evaluations"
    assert ended(of_jacobian=-1.0, evaluations=9) == "no step"


def test_a_step_that_overshoots_is_shortened_and_one_without_a_solution_too() -> None:
    start = line(AT_REST, 1.0, 10.0, of_jacobian=0.3)
    found = iterate(start, solve(0.3), RULE, 60)
    assert found.points[-1].free_parameters[0].value == pytest.approx(1.0, abs=1e-3)
    misfits = [objective(point) for point in found.points]
    assert misfits == sorted(misfits, reverse=True)
    stuck = iterate(line(AT_REST, 1.0, 10.0), solve(1.0, solvable_to=0.05), RULE, 60)
    assert (stuck.ended, str(stuck.failure)) == ("no step", "no equilibrium")
    assert stuck.share < RULE.shortest


@given(seed=st.integers(0, 1000), shared=st.integers(0, 3), missing=st.integers(0, 4))
def test_whitening_makes_the_covariance_one_whatever_is_missing_and_shared(
    seed: int, shared: int, missing: int
) -> None:
    rng = np.random.default_rng(seed)
    seen = np.ones((3, 4), dtype=bool)
    seen.ravel()[rng.choice(12, size=missing, replace=False)] = False
    deviation = rng.uniform(0.1, 3.0, size=4)
    directions = rng.normal(size=(12 - missing, shared))
    whitening = Whitening(seen, deviation, np.zeros(4), *inverse_root(directions))
    noise = np.broadcast_to(deviation, (3, 4))[seen]
    covariance = noise[:, None] * (np.eye(len(noise)) + directions @ directions.T) * noise
    np.testing.assert_allclose(whitening.root() @ whitening.root().T, covariance, atol=1e-9)
    spread = np.zeros((3, 4, 12 - missing))
    spread[seen] = whitening.root()
    np.testing.assert_allclose(whitening.apply(spread), np.eye(12 - missing), atol=1e-9)


@pytest.mark.parametrize("course", [smooth, straight])
def test_a_change_on_a_finer_mesh_is_met_where_it_is_known_and_nothing_at_rest(course: Course) -> None:
    poses = straight_pull(SMALL_BLOCK, 0.012, 6)
    experiment = with_rows(SMALL_BLOCK, poses, np.zeros((6, 6)), np.zeros((6, 9, 3)))
    schedule = schedule_poses(experiment)
    way = travel(schedule)
    known = {2: np.array([1.0, -4.0]), 4: np.array([3.0, -5.0])}
    found = change_along(schedule, known, course)
    assert found.shape == (len(way), 2)
    np.testing.assert_allclose(found[0], 0.0, atol=1e-12)
    for state, change in known.items():
        np.testing.assert_allclose(found[state], change)
    np.testing.assert_allclose(found[5], known[4])
    assert known[2][0] < found[3, 0] < known[4][0]
