"""Gauss–Newton with priors and bounds: the step of one linearised model, and where steps lead."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from estimator.errors import SolverError
from estimator.inference.bounded_minimum import bounded_minimum
from estimator.inference.free_parameter import FreeParameter, prior_information
from estimator.inference.linear_model import (
    LinearModel,
    gram_of,
    negative_log_posterior,
    objective,
    stacked,
)

FloatArray = NDArray[np.float64]
P = TypeVar("P", bound=LinearModel)
End = Literal["converged", "no step", "evaluations"]

# A rise of the objective by so little, of itself or outright, is that of rounding.
_OF_ROUNDING, _ROUNDING = 1e-9, 5e-7


@dataclass(frozen=True, eq=False)
class NewtonStep:
    """The minimum of a linearised model's objective, half of χ² with the priors.

    Attributes
    ----------
    objective : at the present values
    gradient : (p,) of its negative by the internal variables
    information : (p, p) of the internal variables, priors included; the inverse of their covariance
    step : (p,) to the minimum within bounds and trust, internal variables
    """

    objective: float
    gradient: FloatArray
    information: FloatArray
    step: FloatArray

    @property
    def promised(self) -> float:
        """By how much the objective falls once the step is taken, by the linearisation."""
        return float(self.gradient @ self.step - 0.5 * self.step @ self.information @ self.step)

    @property
    def length(self) -> float:
        """The largest change of an internal variable."""
        return float(np.abs(self.step).max(initial=0.0))

    @property
    def covariance(self) -> FloatArray:
        """Covariance (p, p) of the internal variables, as if no bound held any."""
        return np.asarray(np.linalg.inv(self.information), dtype=np.float64)

    @property
    def chi2(self) -> float:
        """Misfit at the present values, priors included."""
        return 2.0 * self.objective

    @property
    def chi2_after(self) -> float:
        """Misfit once the step is taken, by the linearisation."""
        return 2.0 * (self.objective - self.promised)


def newton_step(model: LinearModel) -> NewtonStep:
    """Return the step from where a model is linearised."""
    return step_of_gram(gram_of(stacked(model)), model.free_parameters)


def step_of_gram(gram: FloatArray, free: Sequence[FreeParameter]) -> NewtonStep:
    """Return the same from the Gram matrix (1 + p)² of residual and derivatives."""
    information = gram[1:, 1:] + prior_information(free)
    gradient = gram[1:, 0] - np.array([c.prior_precision * c.prior_offset for c in free])
    step = np.zeros(0)
    if len(free):
        step = bounded_minimum(information, gradient, *np.array([c.reach for c in free]).T)
    return NewtonStep(negative_log_posterior(float(gram[0, 0]), free), gradient, information, step)


@dataclass(frozen=True, slots=True)
class Rule:
    """How far an iteration goes.

    Attributes
    ----------
    worthwhile : it ends where the objective is promised to fall by less
    tolerance : or where no internal variable would change by as much
    least_fall : or after a step by which the objective fell by less
    shortening : share of a step that is tried where it does not do
    shortest : share below which no shorter one is tried
    kept : share of the promised fall that a step must keep
    """

    worthwhile: float
    tolerance: float = 0.0
    least_fall: float = 0.0
    shortening: float = 1 / 3
    shortest: float = 0.1
    kept: float = 0.05


@dataclass(frozen=True, eq=False)
class GaussNewtonResult(Generic[P]):
    """What an iteration has found.

    Attributes
    ----------
    points : linearised where steps were accepted, the start first, the best last
    ended : why it ended
    share : of the step from the last point, which may be tried next: what was longer did not fit better
    fall : by how much the last accepted step lowered the objective; infinite where none was
    failure : why a step had no solution, the last one; None where all had
    """

    points: tuple[P, ...]
    ended: End
    share: float = 1.0
    fall: float = np.inf
    failure: SolverError | None = None


@dataclass(frozen=True, eq=False)
class _Search(Generic[P]):
    """What came of the tries of one step: the point accepted, if any, the next share to try, tries left."""

    accepted: P | None
    share: float
    evaluations: int
    failure: SolverError | None


def iterate(
    start: P, solve: Callable[[P, FloatArray], P], rule: Rule, evaluations: int, share: float = 1.0
) -> GaussNewtonResult[P]:
    """Take Gauss–Newton steps from a point until what remains is too little.

    Parameters
    ----------
    start : linearised where it begins
    solve : linearises the model a step (p,) of its internal variables off a point; where a SolverError tells that it
        has no solution there, a shorter step is tried
    rule : when to end
    evaluations : how many points may be solved
    share : of the first step that is tried first
    """
    points, fall = [start], np.inf
    failure: SolverError | None = None
    while evaluations > 0:
        best = points[-1]
        found = newton_step(best)
        if found.promised < rule.worthwhile or found.length < rule.tolerance:
            return GaussNewtonResult(tuple(points), "converged", share, fall, failure)
        tried = _shortened(best, found, solve, rule, _Search(None, share, evaluations, failure))
        evaluations, failure = tried.evaluations, tried.failure
        if tried.accepted is None:
            return GaussNewtonResult(tuple(points), "no step", tried.share, fall, failure)
        points.append(tried.accepted)
        fall, share = objective(best) - objective(tried.accepted), 1.0
        if fall < rule.least_fall:
            return GaussNewtonResult(tuple(points), "converged", share, fall, failure)
    return GaussNewtonResult(tuple(points), "evaluations", share, fall, failure)


def _shortened(
    best: P, found: NewtonStep, solve: Callable[[P, FloatArray], P], rule: Rule, before: _Search[P]
) -> _Search[P]:
    """Take the step, shortened until it keeps enough of its promise."""
    accepted, share, evaluations, failure = None, before.share, before.evaluations, before.failure
    here = objective(best)
    rounding = _OF_ROUNDING * here + _ROUNDING
    while evaluations > 0 and accepted is None and _is_worthwhile(share, found.promised, rule):
        evaluations -= 1
        try:
            trial = solve(best, share * found.step)
            if objective(trial) < here + rounding - rule.kept * share * found.promised:
                accepted = trial
        except SolverError as error:
            failure = error  # as if it fitted worse: a shorter step may have a solution
        share *= rule.shortening
    return _Search(accepted, share, evaluations, failure)


def _is_worthwhile(share: float, promised: float, rule: Rule) -> bool:
    """Tell whether a share of a step is to be tried: all of it, or one that still promises enough."""
    return share == 1.0 or (share > rule.shortest and share * (2.0 - share) * promised >= rule.worthwhile)
