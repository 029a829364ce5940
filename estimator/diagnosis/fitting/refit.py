"""The best parameters of a hypothesis: every point of the Gauss–Newton iteration solved in full."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.fitting.case import Case, Linearisation, linearise
from estimator.diagnosis.fitting.parallel import Solve
from estimator.diagnosis.model.free_parameters import moved
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.inference.gauss_newton import Rule, iterate

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
    least = settings.worthwhile if worthwhile is None else worthwhile
    begun = near if near is not None and near.hypothesis is start else solve(case, start, near)

    def stepped(at: Linearisation, step: FloatArray) -> Linearisation:
        return solve(case, moved(at.hypothesis, at.free_parameters, step), at)

    rule = Rule(worthwhile=least, least_fall=least, shortest=settings.shortest)
    found = iterate(begun, stepped, rule, evaluations - 1, begun.next_share)
    best = found.points[-1]
    if found.ended == "no step":
        return replace(best, next_share=found.share)
    return replace(best, next_share=0.0) if found.fall < settings.worthwhile else best
