"""Intervals by profile likelihood: how far a parameter can go while all others make up for it as well as they can.

χ² minimised over the others rises by 3.84 at the ends of a 95 % interval (D. J. Venzon and S. H. Moolgavkar, Appl.
Stat. 37 (1988) 87). Its root is nearly linear in the parameter, so that a secant finds the ends in a few refits.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.errors import FitError, SolverError
from estimator.fit.linearised_fit import LinearisedFit
from estimator.fit.search import Linearise, Values, at_values, determined_step, minimise
from estimator.inference.free_parameter import FreeParameter

FloatArray = NDArray[np.float64]

CHI2_95 = 3.841458820694124
_REFITS = 5
# Of the root of χ² at the ends: an end that is off by this share of the half-width.
_TOLERANCE = 0.02
_LINEAR_STEP = 0.02


@dataclass(frozen=True, slots=True)
class Profile:
    """The profile of one parameter.

    Attributes
    ----------
    name : of the parameter
    points : (value, rise of χ² above its minimum), ascending in the value
    interval95 : where the rise reaches 3.84 times the widening; an end at a bound is that bound
    """

    name: str
    points: tuple[tuple[float, float], ...]
    interval95: tuple[float, float]


def profile(
    linearise: Linearise,
    parameters: tuple[FreeParameter, ...],
    number: int,
    best: Values,
    internal_std: float,
    inflation: float,
) -> Profile:
    """Profile one parameter.

    Parameters
    ----------
    linearise : the whitened problem at given values
    parameters : that are free
    number : of the one to profile
    best : values at the optimum
    internal_std : standard deviation of its internal variable by the linearisation, where the search begins
    inflation : by how much intervals are wider than stated noise alone makes them

    Raises
    ------
    FitError
        A refit does not converge, or leaves what can be solved.
    """
    parameter = at_values(parameters, best)[number]
    others = tuple(p for n, p in enumerate(parameters) if n != number)
    kept = [n for n in range(len(parameters)) if n != number]

    def restricted(values: Values) -> LinearisedFit:
        problem = linearise(values)
        free = tuple(problem.free_parameters[n] for n in kept)
        return replace(problem, free_parameters=free, jacobian=(problem.jacobian[0][:, kept],))

    lowest = determined_step(linearise(best)).chi2_after

    def root_of_rise(value: float, start: Values) -> tuple[float, Values]:
        values = {**start, parameter.name: value}
        try:
            iterates, last = minimise(restricted, others, values, _LINEAR_STEP)
        except SolverError as failure:
            raise FitError(
                f"the profile of {parameter.label} leaves what can be solved at {value:.5g}: {failure}"
            ) from failure
        own_prior = parameter.at(value).prior_offset ** 2
        return float(np.sqrt(max(last.chi2_after + own_prior - lowest, 0.0))), iterates[-1].values

    points = {best[parameter.name]: 0.0}
    target = inflation * np.sqrt(CHI2_95)
    ends = [
        _end(root_of_rise, parameter, best, sign * target * internal_std, target, points)
        for sign in (-1.0, 1.0)
    ]
    return Profile(parameter.name, tuple(sorted(points.items())), (ends[0], ends[1]))


def _end(
    root_of_rise: Callable[[float, Values], tuple[float, Values]],
    parameter: FreeParameter,
    best: Values,
    way: float,
    target: float,
    points: dict[float, float],
) -> float:
    """Return the value, on one side, at which the root of the rise reaches the target; add what is solved to points."""
    start, found = best, [(0.0, 0.0)]
    for _ in range(_REFITS):
        there = parameter.after(way)
        value, way = there.value, there.internal - parameter.internal
        if way == found[-1][0]:
            return value
        root, start = root_of_rise(value, start)
        points[value] = root**2
        found.append((way, root))
        at_bound = value in (parameter.lower, parameter.upper)
        if abs(root - target) < _TOLERANCE * target or (at_bound and root < target):
            return value
        (one, below), (other, above) = sorted(found, key=lambda pair: abs(pair[1] - target))[:2]
        way = one + (other - one) * (target - below) / (above - below)
    raise FitError(f"the profile of {parameter.label} does not reach the end of its interval")
