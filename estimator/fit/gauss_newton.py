"""Gauss–Newton steps of the marginal likelihood, and where they lead."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from estimator.errors import FitError, SolverError
from estimator.fit.parameters import FitParameter
from estimator.fit.residuals import WhitenedSystem
from estimator.inference.bounded_minimum import bounded_minimum

FloatArray = NDArray[np.float64]
Values = dict[str, float]

_SHORTENINGS = 6
# A step that promises to lower χ² by less changes no parameter by more than a hundredth of its deviation.
_WORTHLESS = 1e-4
# Smallest ratio of eigenvalues of the scaled information at which its inverse still means something.
_SINGULAR = 1e-12


@dataclass(frozen=True)
class MarginalStep:
    """The linearised problem with its nuisances integrated out.

    Attributes
    ----------
    chi2 : misfit at the present parameters, nuisances at their best
    gradient : (p,) of −χ²/2 by the internal variables
    information : (p, p) of the internal variables; the inverse of their covariance
    step : (p,) to the minimum within the bounds, internal variables, no longer than each parameter permits
    nuisances : (k,) at that minimum, in units of their priors' deviations
    """

    chi2: float
    gradient: FloatArray
    information: FloatArray
    step: FloatArray
    nuisances: FloatArray

    @property
    def covariance(self) -> FloatArray:
        """Covariance (p, p) of the internal variables, as if no bound held any."""
        return np.asarray(np.linalg.inv(self.information), dtype=np.float64)

    @property
    def chi2_after(self) -> float:
        """Misfit once the step is taken, by the linearisation."""
        return self.chi2 - float(2 * self.gradient @ self.step - self.step @ self.information @ self.step)


@dataclass(frozen=True, slots=True)
class Iterate:
    """A point of the iteration: parameter values by name, and the misfit there."""

    values: dict[str, float]
    chi2: float


def marginal_step(
    system: WhitenedSystem, parameters: tuple[FitParameter, ...], values: Values
) -> MarginalStep:
    """Solve the linearised problem at ``values`` within the bounds.

    Raises
    ------
    FitError
        The data do not determine the parameters.
    """
    r, J, N = system.residual, system.by_parameter, system.by_nuisance
    factor = cho_factor(N.T @ N + np.eye(N.shape[1]))
    reduced = np.column_stack([r, J]) - N @ cho_solve(factor, N.T @ np.column_stack([r, J]))
    gradient, information = J.T @ reduced[:, 0], J.T @ reduced[:, 1:]
    _check_determined(information, parameters)
    step = _step_within_bounds(gradient, information, parameters, values)
    nuisances = cho_solve(factor, N.T @ (r - J @ step))
    return MarginalStep(float(r @ reduced[:, 0]), gradient, information, step, nuisances)


def _check_determined(information: FloatArray, parameters: tuple[FitParameter, ...]) -> None:
    scale = np.sqrt(np.diag(information))
    if not parameters:
        return
    silent = [p.label for p, s in zip(parameters, scale, strict=True) if not s > 0]
    reason = f"nothing depends on {' and '.join(silent)}"
    if not silent:
        weakness, directions = np.linalg.eigh(information / np.outer(scale, scale))
        if weakness[0] > _SINGULAR * weakness[-1]:
            return
        involved = np.abs(directions[:, 0]) > 0.3 * np.abs(directions[:, 0]).max()
        names = [p.label for p, member in zip(parameters, involved, strict=True) if member]
        reason = f"{' and '.join(names)} cannot be told apart"
    raise FitError(
        f"the measurements do not determine the parameters: {reason}; add a motion that strains the tissue "
        "otherwise, a prior, or fix one of them"
    )


def _step_within_bounds(
    gradient: FloatArray, information: FloatArray, parameters: tuple[FitParameter, ...], values: Values
) -> FloatArray:
    """Return the step to the minimum of the linearised misfit within the bounds and as far as it can be trusted."""
    if not parameters:
        return np.zeros(0)
    here = np.array([p.to_internal(values[p.name]) for p in parameters])
    longest = np.array([p.longest_step for p in parameters])
    lower = np.maximum([p.to_internal(p.lower) for p in parameters] - here, -longest)
    upper = np.minimum([p.to_internal(p.upper) for p in parameters] - here, longest)
    return bounded_minimum(information, gradient, lower, upper)


def minimise(
    linearise: Callable[[Values], WhitenedSystem],
    parameters: tuple[FitParameter, ...],
    start: Values,
    tolerance: float,
    iterations: int = 20,
) -> tuple[list[Iterate], MarginalStep]:
    """Iterate until what remains is linear or nothing: a step shorter than ``tolerance`` in every internal variable.

    The step that remains is not taken; its error would be of the order of its square.

    Returns
    -------
    iterates : every accepted point, the start first
    last : the linearised problem at the last of them

    Raises
    ------
    FitError
        No convergence; the message tells why.
    """
    values = dict(start)
    last = marginal_step(linearise(values), parameters, values)
    iterates = [Iterate(values, last.chi2)]
    for _ in range(iterations):
        promised = last.chi2 - last.chi2_after
        if float(np.abs(last.step).max(initial=0.0)) < tolerance or promised < _WORTHLESS:
            return iterates, last
        values, last = _shortened(linearise, parameters, values, last)
        iterates.append(Iterate(values, last.chi2))
    moving = [p.label for p, step in zip(parameters, last.step, strict=True) if abs(step) >= tolerance]
    raise FitError(
        f"the fit has not converged in {iterations} iterations: {', '.join(moving)} still moved at {_words(values)}; "
        "where the measurements hardly determine a parameter, fix it or give it a prior"
    )


def moved(parameters: tuple[FitParameter, ...], values: Values, step: FloatArray) -> Values:
    """Return the values after a step in the internal variables, kept within the bounds."""
    result = dict(values)
    for parameter, change in zip(parameters, step, strict=True):
        value = parameter.from_internal(parameter.to_internal(values[parameter.name]) + float(change))
        result[parameter.name] = min(max(value, parameter.lower), parameter.upper)
    return result


def _shortened(
    linearise: Callable[[Values], WhitenedSystem],
    parameters: tuple[FitParameter, ...],
    values: Values,
    last: MarginalStep,
) -> tuple[Values, MarginalStep]:
    """Take the step, halved until the misfit falls."""
    step = last.step
    failure: SolverError | None = None
    for _ in range(_SHORTENINGS):
        trial = moved(parameters, values, step)
        try:
            candidate = marginal_step(linearise(trial), parameters, trial)
        except SolverError as error:
            failure = error
        else:
            if candidate.chi2 <= last.chi2 * (1 + 1e-9) + 1e-6:
                return trial, candidate
        step = step / 2
    reason = f": {failure}" if failure else "; the data contradict the model, or each other"
    raise FitError(f"no step from {_words(values)} lowers the misfit{reason}")


def _words(values: Values) -> str:
    return ", ".join(f"{name} = {value:.5g}" for name, value in values.items())
