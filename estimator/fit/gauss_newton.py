"""Gauss–Newton steps of the marginal likelihood, and where they lead."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from estimator.errors import FitError, SolverError
from estimator.fit.parameters import FitParameter
from estimator.fit.residuals import WhitenedSystem

FloatArray = NDArray[np.float64]
Values = dict[str, float]

# No step multiplies 1 − 2ν or E by more than e^1.5: the linearisation holds no farther.
_LONGEST_STEP = 1.5
_SHORTENINGS = 6


@dataclass(frozen=True)
class MarginalStep:
    """The linearised problem with its nuisances integrated out.

    Attributes
    ----------
    chi2 : misfit at the present parameters, nuisances at their best
    gradient : (p,) of −χ²/2 by the internal variables
    information : (p, p) of the internal variables; the inverse of their covariance
    step : (p,) to the minimum, internal variables; zero for a parameter that a bound holds
    """

    chi2: float
    gradient: FloatArray
    information: FloatArray
    step: FloatArray

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
    scale = np.sqrt(np.diag(information))
    if not np.all(scale > 0) or np.linalg.cond(information / np.outer(scale, scale)) > 1e12:
        raise FitError(
            "the measurements do not determine the parameters; add a motion that strains the tissue"
        )
    step = _step_within_bounds(gradient, information, parameters, values)
    return MarginalStep(float(r @ reduced[:, 0]), gradient, information, step)


def _step_within_bounds(
    gradient: FloatArray, information: FloatArray, parameters: tuple[FitParameter, ...], values: Values
) -> FloatArray:
    """Return the Newton step of the parameters that are not pushed against a bound at which they stand."""
    held = np.array(
        [
            (values[p.name] >= p.upper and slope > 0) or (values[p.name] <= p.lower and slope < 0)
            for p, slope in zip(parameters, gradient, strict=True)
        ]
    )
    step = np.zeros(len(gradient))
    free = ~held
    if free.any():
        step[free] = np.linalg.solve(information[np.ix_(free, free)], gradient[free])
    return step


def minimise(
    linearise: Callable[[Values], WhitenedSystem],
    parameters: tuple[FitParameter, ...],
    start: Values,
    tolerance: float,
    iterations: int = 20,
) -> tuple[list[Iterate], MarginalStep]:
    """Iterate until what remains is linear: a step shorter than ``tolerance`` in every internal variable.

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
        if float(np.abs(last.step).max()) < tolerance:
            return iterates, last
        values, last = _shortened(linearise, parameters, values, last)
        iterates.append(Iterate(values, last.chi2))
    raise FitError(
        f"the fit has not converged in {iterations} iterations; the last point was {_words(values)}"
    )


def moved(parameters: tuple[FitParameter, ...], values: Values, step: FloatArray) -> Values:
    """Return the values after a step in the internal variables, kept within the bounds."""
    result = {}
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
    step = last.step * min(1.0, _LONGEST_STEP / float(np.abs(last.step).max()))
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
