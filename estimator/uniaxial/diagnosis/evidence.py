r"""The marginal likelihood of a hypothesis by Laplace's approximation, in parameters z whose prior is standard normal.

    ln Z = ln p(y | z*) - ½ z*ᵀz* - ½ ln det H,  H = 1 + Jᵀ P J at the maximum z*

L. Tierney & J. B. Kadane, J. Am. Stat. Assoc. 81 (1986) 82. J is how the stresses change with z, P the inverse
covariance of the rows once E and the zeros are free (Gauss and Newton's H, which Fisher's scoring climbs by).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from estimator.errors import SolverError
from estimator.inference.bounded_minimum import bounded_minimum
from estimator.uniaxial.diagnosis.causes import NONE, Form
from estimator.uniaxial.diagnosis.likelihood import Fitted, Likelihood
from estimator.uniaxial.diagnosis.specimen import Specimen, stress_per_modulus
from estimator.uniaxial.records import FloatArray

_LARGEST = 1e4  # stress over modulus that no test reaches
_STARTS = 16
_CLIMBS = 2
_MOST_STEPS = 15
_LONGEST_STEP = 1.5  # prior deviations
_SHARES_OF_STEP = (1.0, 0.3, 0.1, 0.03)
_WORTHWHILE = 0.03  # of the log density
_DIFFERENCE = 0.5  # of a deviation of what is known
_SMALLEST_DIFFERENCE, _LARGEST_DIFFERENCE = 1e-3, 0.2


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


@dataclass(frozen=True, slots=True, eq=False)
class _Point:
    """Parameters z (k,) with the stresses per modulus (r,) and the fit there."""

    z: FloatArray
    unit: FloatArray
    fit: Fitted

    @property
    def height(self) -> float:
        return self.fit.log_density - 0.5 * float(self.z @ self.z)


@dataclass(frozen=True, slots=True, eq=False)
class _Slope:
    """At a point the gradient of the height (k,), H (k, k), and how E goes along (k,)."""

    gradient: FloatArray
    information: FloatArray
    modulus_along: FloatArray


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
) -> Weighed | None:
    """Find the most probable parameters of a hypothesis and integrate over them; None where none are possible.

    Parameters
    ----------
    amplitudes : of the discrepancy; as :meth:`Likelihood.of` has it
    starts : where to begin; without any, points spread over the prior
    """
    landscape = _Landscape(forms, likelihood, amplitudes)
    points = [point for z in (starts or _spread(landscape.count)) if (point := landscape.at(z))]
    points = sorted(points, key=lambda point: -point.height)[:_CLIMBS]
    if not points:
        return None
    top, slope = max((_climbed(landscape, point) for point in points), key=lambda found: found[0].height)
    covariance = np.asarray(np.linalg.inv(slope.information), dtype=np.float64)
    along = slope.modulus_along
    return Weighed(
        forms,
        top.height - 0.5 * float(np.linalg.slogdet(slope.information)[1]),
        top.z,
        covariance,
        top.fit.modulus,
        float(np.sqrt(top.fit.modulus_std**2 + along @ covariance @ along)),
    )


class _Landscape:
    """The log density of rows over the parameters of a hypothesis."""

    def __init__(
        self, forms: tuple[Form, ...], likelihood: Likelihood, amplitudes: Sequence[float] | None
    ) -> None:
        self.count = sum(len(form.priors) for form in forms)
        self._forms, self._likelihood, self._amplitudes = forms, likelihood, amplitudes
        self._null = likelihood.along([stress_per_modulus(Specimen(), rows) for rows in likelihood.tests])

    def at(self, z: FloatArray) -> _Point | None:
        """Return the point at z; None where no specimen can be so."""
        specimen = specimen_with(self._forms, z)
        try:
            stresses = [stress_per_modulus(specimen, rows) for rows in self._likelihood.tests]
        except SolverError:
            return None
        if not all(np.abs(values).max() < _LARGEST and np.any(values) for values in stresses):
            return None
        unit = self._likelihood.along(stresses)
        fit = self._likelihood.of(unit, self._null, self._amplitudes)
        return None if fit is None else _Point(z, unit, fit)

    def slope(self, point: _Point, differences: FloatArray) -> _Slope:
        """Return what is known at a point, by central differences of so much in z (k,)."""
        gradient = np.zeros(self.count)
        changes = np.zeros((len(point.unit), self.count))
        for number, step in enumerate(np.diag(differences)):
            ends = [self.at(point.z + step) or point, self.at(point.z - step) or point]
            apart = max(float(ends[0].z[number] - ends[1].z[number]), 1e-300)
            gradient[number] = (ends[0].height - ends[1].height) / apart
            changes[:, number] = (ends[0].unit - ends[1].unit) / apart
        information, modulus_along = point.fit.about(changes)
        return _Slope(gradient, information + np.eye(self.count), modulus_along)


def _spread(count: int) -> list[FloatArray]:
    if count == 0:
        return [np.empty(0)]
    draws = qmc.Sobol(count, scramble=False).random(_STARTS * 2 ** (count - 1))
    return [np.asarray(ndtri(0.02 + 0.96 * draw)) for draw in draws]


def _climbed(landscape: _Landscape, start: _Point) -> tuple[_Point, _Slope]:
    """Climb by Fisher's scoring until a step promises too little."""
    best = start
    slope = landscape.slope(best, np.full(landscape.count, 0.05))
    for _ in range(_MOST_STEPS if landscape.count else 0):
        longest = np.full(landscape.count, _LONGEST_STEP)
        step = bounded_minimum(slope.information, slope.gradient, -longest, longest)
        promised = 0.5 * float(step @ slope.gradient)
        if promised < _WORTHWHILE:
            break
        for share in _SHARES_OF_STEP:
            tried = landscape.at(best.z + share * step)
            if tried is not None and tried.height > best.height + 0.05 * share * promised:
                break
        else:
            break
        best = tried
        known = _DIFFERENCE / np.sqrt(np.diag(slope.information))
        slope = landscape.slope(best, np.clip(known, _SMALLEST_DIFFERENCE, _LARGEST_DIFFERENCE))
    return best, slope
