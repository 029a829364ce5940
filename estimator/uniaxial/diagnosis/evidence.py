r"""The marginal likelihood of a hypothesis by Laplace's approximation, in parameters z whose prior is standard normal.

    ln Z = ln p(y | z*) - ½ z*ᵀz* - ½ ln det H,  H = -∇∇ (ln p - ½ zᵀz) at the maximum z*

L. Tierney & J. B. Kadane, J. Am. Stat. Assoc. 81 (1986) 82.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.stats import norm, qmc

from estimator.errors import SolverError
from estimator.uniaxial.diagnosis.causes import NONE, Form
from estimator.uniaxial.diagnosis.likelihood import Fitted, Likelihood
from estimator.uniaxial.diagnosis.rows import Rows
from estimator.uniaxial.diagnosis.specimen import Specimen, stress_per_modulus
from estimator.uniaxial.records import FloatArray

_IMPOSSIBLE = -1e12
_LARGEST = 1e4  # stress over modulus that no test reaches
_STARTS_PER_PARAMETER = 16
_STEPS_PER_PARAMETER = 70
_CURVATURE_DROP = 0.5
_COORDINATE = 8.0


@dataclass(frozen=True, slots=True, eq=False)
class Weighed:
    """A hypothesis at its most probable parameters.

    Attributes
    ----------
    forms : none for the Neo-Hookean specimen
    log_evidence : up to a constant that all share
    z, covariance : (k,), (k, k) of its parameters
    modulus, modulus_std : E, Pa
    """

    forms: tuple[Form, ...]
    log_evidence: float
    z: FloatArray
    covariance: FloatArray
    modulus: float
    modulus_std: float

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the causes."""
        return tuple(form.label for form in self.forms) or (NONE,)


def specimen_with(forms: Sequence[Form], z: FloatArray) -> Specimen:
    """Return a specimen with causes whose parameters stand behind each other in z."""
    specimen, place = Specimen(), 0
    for form in forms:
        specimen = form.applied(specimen, z[place : place + len(form.priors)])
        place += len(form.priors)
    return specimen


def weigh(
    forms: tuple[Form, ...],
    likelihood: Likelihood,
    amplitudes: Sequence[float] | None = None,
    starts: Sequence[FloatArray] = (),
) -> Weighed:
    """Find the most probable parameters of a hypothesis and integrate over them.

    Parameters
    ----------
    starts : where to begin; without any, points spread over the prior
    """
    tests: list[Rows] = [rows for rows, _ in likelihood.tests]
    null = [stress_per_modulus(Specimen(), rows) for rows in tests]
    count = sum(len(form.priors) for form in forms)

    def fitted(z: FloatArray) -> Fitted:
        try:
            unit = [stress_per_modulus(specimen_with(forms, z), rows) for rows in tests]
        except SolverError:
            return Fitted(_IMPOSSIBLE, np.nan, np.nan)
        if not all(np.abs(values).max() < _LARGEST and np.any(values) for values in unit):
            return Fitted(_IMPOSSIBLE, np.nan, np.nan)
        return likelihood.of(unit, null, amplitudes)

    def height(z: FloatArray) -> float:
        return max(fitted(z).log_density, _IMPOSSIBLE) - 0.5 * float(z @ z)

    if count == 0:
        fit = fitted(np.empty(0))
        return Weighed(forms, fit.log_density, np.empty(0), np.empty((0, 0)), fit.modulus, fit.modulus_std)
    begun = list(starts) or _spread(count)
    best = sorted(begun, key=height, reverse=True)[:2]
    found = max((_climbed(height, z) for z in best), key=height)
    curvature = _curvature(height, found)
    values, vectors = np.linalg.eigh(curvature)
    values = np.maximum(values, 1.0)  # that of the prior
    covariance = np.asarray(vectors @ np.diag(1 / values) @ vectors.T)
    fit = fitted(found)
    spread = _modulus_spread(fitted, found, values, vectors)
    return Weighed(
        forms,
        height(found) - 0.5 * float(np.sum(np.log(values))),
        found,
        covariance,
        fit.modulus,
        float(np.hypot(fit.modulus_std, spread)),
    )


def _spread(count: int) -> list[FloatArray]:
    draws = qmc.Sobol(count, scramble=False).random(_STARTS_PER_PARAMETER * 2 ** (count - 1))
    return [np.asarray(norm.ppf(0.02 + 0.96 * draw)) for draw in draws]


def _climbed(height: Callable[[FloatArray], float], start: FloatArray) -> FloatArray:
    # the first simplex reaches 5 % of a coordinate beyond its start: 0.4 of a prior's deviation
    unit = np.ones(len(start))

    def depth(u: FloatArray) -> float:
        return -height(start + _COORDINATE * (u - unit))

    most = _STEPS_PER_PARAMETER * len(start)
    found = minimize(
        depth, unit, method="Nelder-Mead", options={"maxfev": most, "xatol": 1e-4, "fatol": 1e-2}
    )
    return np.asarray(start + _COORDINATE * (found.x - unit))


def _curvature(height: Callable[[FloatArray], float], z: FloatArray) -> FloatArray:
    """Return minus the second derivatives, by steps over which the height falls by about a half."""
    top, count = height(z), len(z)
    axes = np.eye(count)
    steps = np.full(count, 0.3)
    for n in range(count):
        for _ in range(7):
            fall = top - 0.5 * (height(z + steps[n] * axes[n]) + height(z - steps[n] * axes[n]))
            if fall <= 2 * _CURVATURE_DROP:
                break
            steps[n] *= max(float(np.sqrt(_CURVATURE_DROP / fall)), 0.1)
    found = np.zeros((count, count))
    for i in range(count):
        for j in range(i + 1):
            a, b = steps[i] * axes[i], steps[j] * axes[j]
            if i == j:
                found[i, i] = (2 * top - height(z + a) - height(z - a)) / steps[i] ** 2
            else:
                cross = height(z + a + b) - height(z + a - b) - height(z - a + b) + height(z - a - b)
                found[i, j] = found[j, i] = -cross / (4 * steps[i] * steps[j])
    return found


def _modulus_spread(
    fitted: Callable[[FloatArray], Fitted], z: FloatArray, values: FloatArray, vectors: FloatArray
) -> float:
    total = 0.0
    for value, vector in zip(values, vectors.T, strict=True):
        ends = [fitted(z + sign * vector / np.sqrt(value)).modulus for sign in (1, -1)]
        if np.isfinite(ends).all():
            total += ((ends[0] - ends[1]) / 2) ** 2
    return float(np.sqrt(total))
