"""The best parameters of a hypothesis: Gauss–Newton with priors and bounds, every point solved in full."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.fitting.case import Case, Linearisation, linearise
from estimator.diagnosis.fitting.parallel import Solve
from estimator.diagnosis.model.free_parameters import FreeParameter
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.settings import FittingSettings
from estimator.errors import SolverError
from estimator.inference.bounded_minimum import bounded_minimum

FloatArray = NDArray[np.float64]


def refit(
    case: Case,
    start: Hypothesis,
    near: Linearisation | None = None,
    evaluations: int = 6,
    solve: Solve = linearise,
    worthwhile: float | None = None,
) -> Linearisation:
    """Return the linearisation at the best parameters found.

    Parameters
    ----------
    case : Case
    start : where to begin
    near : a solved neighbour of the start
    evaluations : how many points may be solved
    solve : what solves a point
    worthwhile : the iteration ends where the objective would fall by less; by default as the settings say. The place of
        an inclusion that is hardly seen would be followed for ever, step by short step

    Raises
    ------
    SolverError
        The starting point has no equilibrium.
    """
    settings = case.settings.fitting
    worthwhile = settings.worthwhile if worthwhile is None else worthwhile
    best = near if near is not None and near.hypothesis is start else solve(case, start, near)
    evaluations -= 1
    while evaluations > 0:
        step, gain = newton_step(best, settings)
        if gain < worthwhile:
            break
        accepted, share = None, best.next_share
        while (
            evaluations > 0 and accepted is None and _worthwhile(share, gain, worthwhile, settings.shortest)
        ):
            evaluations -= 1
            try:
                trial = solve(case, moved(best.hypothesis, best.free_parameters, share * step), best)
                if objective(trial) < objective(best) - 0.05 * share * gain:
                    accepted = trial
            except SolverError:
                pass  # as if it fitted worse: a shorter step may have an equilibrium
            share /= 3.0
        if accepted is None:
            return replace(best, next_share=share)
        fall = objective(best) - objective(accepted)
        best = accepted
        if fall < settings.worthwhile:
            best = replace(accepted, next_share=0.0)
        if fall < worthwhile:
            break
    return best


def _worthwhile(share: float, gain: float, least: float, shortest: float) -> bool:
    """Tell whether a share of a step that promises a gain is to be tried: all of it, a third, a ninth."""
    return share == 1.0 or (share > shortest and share * (2.0 - share) * gain >= least)


def objective(linearisation: Linearisation) -> float:
    """Return half of χ² plus the priors' share: the negative log posterior up to a constant."""
    offsets = [c.prior_offset(linearisation.hypothesis) for c in linearisation.free_parameters]
    return 0.5 * linearisation.chi2 + 0.5 * float(np.sum(np.square(offsets)))


def newton_step(linearisation: Linearisation, settings: FittingSettings) -> tuple[FloatArray, float]:
    """Return the step (p,) to the minimum of the linearised objective within the bounds, and the fall it promises."""
    stacked = [
        np.column_stack(pair) for pair in zip(linearisation.residual, linearisation.jacobian, strict=True)
    ]
    gram = np.sum([block.T @ block for block in stacked], axis=0)
    return step_of_gram(gram, linearisation.hypothesis, linearisation.free_parameters, settings)


def step_of_gram(
    gram: FloatArray, hypothesis: Hypothesis, free: Sequence[FreeParameter], settings: FittingSettings
) -> tuple[FloatArray, float]:
    """Return the same from the Gram matrix (1 + p)² of residual and derivatives at a hypothesis."""
    precision = np.array([c.prior_precision for c in free])
    information = gram[1:, 1:] + np.diag(precision**2)
    gradient = gram[1:, 0] - precision * [c.prior_offset(hypothesis) for c in free]
    lower, upper = np.array([_limits(c, hypothesis, settings) for c in free]).T
    step = bounded_minimum(information, gradient, lower, upper)
    return step, float(gradient @ step - 0.5 * step @ information @ step)


def moved(hypothesis: Hypothesis, free: Sequence[FreeParameter], step: FloatArray) -> Hypothesis:
    """Return a hypothesis after a step (p,) of its internal variables."""
    for parameter, change in zip(free, step, strict=True):
        hypothesis = parameter.put(hypothesis, parameter.get(hypothesis) + float(change))
    return hypothesis


def _limits(
    parameter: FreeParameter, hypothesis: Hypothesis, settings: FittingSettings
) -> tuple[float, float]:
    here = parameter.get(hypothesis)
    longest = settings.longest_step
    if parameter.scale is not None:
        share = settings.longest_in_scales if parameter.has_null else settings.longest_of_a_range
        longest = share * parameter.scale
    low = parameter.internal_of(parameter.lower) if np.isfinite(parameter.lower) else -np.inf
    high = parameter.internal_of(parameter.upper) if np.isfinite(parameter.upper) else np.inf
    return max(low - here, -longest), min(high - here, longest)
