"""The search for the parameters at which the misfit is smallest, and why it may end without them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.errors import FitError
from estimator.fit.linearised_fit import LinearisedFit
from estimator.inference.free_parameter import FreeParameter
from estimator.inference.gauss_newton import GaussNewtonResult, NewtonStep, Rule, iterate, newton_step
from estimator.inference.linear_model import objective

FloatArray = NDArray[np.float64]
Values = dict[str, float]
Linearise = Callable[[Values], LinearisedFit]

# Points solved in one search at the most.
_EVALUATIONS = 40
# A step that promises to lower χ² by less changes no parameter by more than a hundredth of its deviation.
_WORTHLESS = 1e-4
# Where no step lowers the misfit, one that promises less is none: it would change no parameter by more than a tenth of
# its deviation, which is the wider the more the misfit exceeds the noise.
_NEARLY_WORTHLESS = 1e-2
# Smallest ratio of eigenvalues of the scaled information at which its inverse still means something.
_SINGULAR = 1e-12


@dataclass(frozen=True, slots=True)
class Iterate:
    """A point of the iteration: parameter values by name, and the misfit there."""

    values: dict[str, float]
    chi2: float


def at_values(parameters: Sequence[FreeParameter], values: Mapping[str, float]) -> tuple[FreeParameter, ...]:
    """Return parameters at the values that go by their names."""
    return tuple(parameter.at(values[parameter.name]) for parameter in parameters)


def moved(parameters: Sequence[FreeParameter], values: Values, step: FloatArray) -> Values:
    """Return the values after a step of the parameters' internal variables, kept within the bounds."""
    there = [p.after(float(change)) for p, change in zip(at_values(parameters, values), step, strict=True)]
    return {**values, **{parameter.name: parameter.value for parameter in there}}


def internal_change(parameters: Sequence[FreeParameter], before: Values, after: Values) -> FloatArray:
    """Return the change (p,) of the parameters' internal variables from some values to others."""
    pairs = zip(at_values(parameters, before), at_values(parameters, after), strict=True)
    return np.array([new.internal - old.internal for old, new in pairs])


def determined_step(problem: LinearisedFit) -> NewtonStep:
    """Return the Newton step of a problem.

    Raises
    ------
    FitError
        The data do not determine the parameters.
    """
    found = newton_step(problem)
    _check_determined(found.information, problem.free_parameters)
    return found


def search(
    linearise: Linearise, start: Values, rule: Rule, evaluations: int
) -> GaussNewtonResult[LinearisedFit]:
    """Take Gauss–Newton steps from the values of all parameters at the start.

    Raises
    ------
    FitError
        The data do not determine the parameters.
    """

    def solved(values: Values) -> LinearisedFit:
        problem = linearise(values)
        determined_step(problem)
        return problem

    def stepped(problem: LinearisedFit, step: FloatArray) -> LinearisedFit:
        return solved(moved(problem.free_parameters, values_at(problem, start), step))

    return iterate(solved(dict(start)), stepped, rule, evaluations)


def values_at(problem: LinearisedFit, start: Values) -> Values:
    """Return all values where a problem is linearised; those of parameters that are not free are as at the start."""
    return {**start, **{parameter.name: parameter.value for parameter in problem.free_parameters}}


def minimise(
    linearise: Linearise, parameters: Sequence[FreeParameter], start: Values, tolerance: float
) -> tuple[list[Iterate], NewtonStep]:
    """Iterate until what remains is linear or nothing: a step shorter than ``tolerance`` in every internal variable.

    The step that remains is not taken; its error would be of the order of its square.

    Returns
    -------
    iterates : every accepted point, the start first
    last : the step from the last of them

    Raises
    ------
    FitError
        No convergence, or the data do not determine the parameters; the message tells why.
    """
    rule = Rule(worthwhile=_WORTHLESS / 2, tolerance=tolerance, shortening=0.5, shortest=1 / 50, kept=0.0)
    found = search(linearise, start, rule, _EVALUATIONS)
    iterates = [Iterate(values_at(one, start), 2.0 * objective(one)) for one in found.points]
    last, here = newton_step(found.points[-1]), _words(iterates[-1].values)
    if 2.0 * last.promised < _NEARLY_WORTHLESS * max(1.0, last.chi2 / len(found.points[-1].residual[0])):
        return iterates, last
    match found.ended:
        case "no step":
            reason = (
                f": {found.failure}" if found.failure else "; the data contradict the model, or each other"
            )
            raise FitError(f"no step from {here} lowers the misfit{reason}")
        case "evaluations":
            moving = [p.label for p, s in zip(parameters, last.step, strict=True) if abs(s) >= tolerance]
            raise FitError(
                f"the fit has not converged in {len(iterates) - 1} iterations: {', '.join(moving)} still moved at "
                f"{here}; where the measurements hardly determine a parameter, fix it or give it a prior"
            )
    return iterates, last


def _check_determined(information: FloatArray, parameters: Sequence[FreeParameter]) -> None:
    scale = np.sqrt(np.diag(information))
    silent = [p.label for p, s in zip(parameters, scale, strict=True) if not s > 0]
    reason = f"nothing depends on {' and '.join(silent)}" if silent else ""
    if parameters and not silent:
        weakness, directions = np.linalg.eigh(information / np.outer(scale, scale))
        involved = np.abs(directions[:, 0]) > 0.3 * np.abs(directions[:, 0]).max()
        names = [p.label for p, member in zip(parameters, involved, strict=True) if member]
        if weakness[0] <= _SINGULAR * weakness[-1]:
            reason = f"{' and '.join(names)} cannot be told apart"
    if reason:
        raise FitError(
            f"the measurements do not determine the parameters: {reason}; add a motion that strains the tissue "
            "otherwise, a prior, or fix one of them"
        )


def _words(values: Values) -> str:
    return ", ".join(f"{name} = {value:.5g}" for name, value in values.items())
