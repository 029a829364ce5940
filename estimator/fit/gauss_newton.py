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

# No step multiplies 1 − 2ν or E by more than e^1.5: the linearisation holds no farther.
_LONGEST_STEP = 1.5
_SHORTENINGS = 6


@dataclass(frozen=True)
class MarginalStep:
    """The linearised problem with its nuisances integrated out.

    Attributes
    ----------
    chi2 : misfit at the present parameters, nuisances at their best
    step : (p,) to the minimum, internal variables
    covariance : (p, p) of the internal variables
    nuisances : (k,) best values, in units of their priors
    """

    chi2: float
    step: FloatArray
    covariance: FloatArray
    nuisances: FloatArray


@dataclass(frozen=True, slots=True)
class Iterate:
    """A point of the iteration: parameter values by name, and the misfit there."""

    values: dict[str, float]
    chi2: float


def marginal_step(system: WhitenedSystem) -> MarginalStep:
    """Solve the linearised problem.

    Raises
    ------
    FitError
        The data do not determine the parameters.
    """
    r, J, N = system.residual, system.by_parameter, system.by_nuisance
    factor = cho_factor(N.T @ N + np.eye(N.shape[1]))
    reduced = np.column_stack([r, J]) - N @ cho_solve(factor, N.T @ np.column_stack([r, J]))
    information = J.T @ reduced[:, 1:]
    scale = np.sqrt(np.diag(information))
    if not np.all(scale > 0) or np.linalg.cond(information / np.outer(scale, scale)) > 1e12:
        raise FitError(
            "the measurements do not determine the parameters; add a motion that strains the tissue"
        )
    covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
    step = covariance @ (J.T @ reduced[:, 0])
    nuisances = cho_solve(factor, N.T @ (r - J @ step))
    return MarginalStep(float(r @ reduced[:, 0]), step, covariance, nuisances)


def minimise(
    linearise: Callable[[dict[str, float]], WhitenedSystem],
    parameters: tuple[FitParameter, ...],
    start: dict[str, float],
    tolerance: float,
    iterations: int = 15,
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
    last = marginal_step(linearise(values))
    iterates = [Iterate(values, last.chi2)]
    for _ in range(iterations):
        if float(np.abs(last.step).max()) < tolerance:
            return iterates, last
        values, last = _shortened(linearise, parameters, values, last)
        iterates.append(Iterate(values, last.chi2))
    raise FitError(
        f"the fit has not converged in {iterations} iterations; the last point was {_words(values)}"
    )


def moved(
    parameters: tuple[FitParameter, ...], values: dict[str, float], step: FloatArray
) -> dict[str, float]:
    """Return the values after a step in the internal variables, kept within the bounds."""
    result = {}
    for parameter, change in zip(parameters, step, strict=True):
        value = parameter.from_internal(parameter.to_internal(values[parameter.name]) + float(change))
        result[parameter.name] = min(max(value, parameter.lower), parameter.upper)
    return result


def _shortened(
    linearise: Callable[[dict[str, float]], WhitenedSystem],
    parameters: tuple[FitParameter, ...],
    values: dict[str, float],
    last: MarginalStep,
) -> tuple[dict[str, float], MarginalStep]:
    """Take the step, halved until the misfit falls."""
    step = last.step * min(1.0, _LONGEST_STEP / float(np.abs(last.step).max()))
    failure: SolverError | None = None
    for _ in range(_SHORTENINGS):
        trial = moved(parameters, values, step)
        try:
            candidate = marginal_step(linearise(trial))
        except SolverError as error:
            failure = error
        else:
            if candidate.chi2 <= last.chi2 * (1 + 1e-9) + 1e-6:
                return trial, candidate
        step = step / 2
    reason = f": {failure}" if failure else "; the data contradict the model, or each other"
    raise FitError(f"no step from {_words(values)} lowers the misfit{reason}")


def _words(values: dict[str, float]) -> str:
    return ", ".join(f"{name} = {value:.5g}" for name, value in values.items())
