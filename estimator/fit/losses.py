"""Robust losses: how much weight a measurement keeps that lies far from its prediction.

A loss ρ(r) of the residual r in units of its noise is minimised by least squares whose weights are renewed until they
stand still, w(r) = ρ′(r) / r (P. J. Huber, "Robust Statistics", 1981, section 7.8; the triggered weights of bundle
adjustment, B. Triggs et al., 2000, section 4.3). The tuning constants give 95 % efficiency on normal noise
(P. W. Holland and R. E. Welsch, Commun. Stat. A 6 (1977) 813).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError

FloatArray = NDArray[np.float64]

_HUBER = 1.345
_CAUCHY = 2.385


@dataclass(frozen=True, slots=True)
class Loss:
    """A loss by its name, for residuals in units of their noise.

    Attributes
    ----------
    weight : w(r) in [0, 1]
    slope : ψ′(r), the derivative of ψ(r) = w(r) r = ρ′(r)
    """

    name: str
    weight: Callable[[FloatArray], FloatArray]
    slope: Callable[[FloatArray], FloatArray]

    def variance_factor(self, residual: FloatArray) -> float:
        """Return what turns the weighted mean square of residuals into the variance per weight of an estimate.

        The estimate's variance is ⟨ψ²⟩ / ⟨ψ′⟩² times that of a unit-noise least-squares fit (Huber 1981, section 7.6),
        while weighted least squares believes ⟨w r²⟩ / ⟨w⟩ / ⟨w⟩. One for the linear loss.
        """
        weight = self.weight(residual)
        believed = np.mean(weight * residual**2) / np.mean(weight) ** 2
        true = np.mean((weight * residual) ** 2) / np.mean(self.slope(residual)) ** 2
        return float(true / believed) if believed > 0 else 1.0


def _one(residual: FloatArray) -> FloatArray:
    return np.ones_like(residual)


def _huber(residual: FloatArray) -> FloatArray:
    return np.asarray(_HUBER / np.maximum(np.abs(residual), _HUBER))


def _huber_slope(residual: FloatArray) -> FloatArray:
    return np.asarray(np.abs(residual) <= _HUBER, dtype=np.float64)


def _cauchy(residual: FloatArray) -> FloatArray:
    return np.asarray(1 / (1 + (residual / _CAUCHY) ** 2))


def _cauchy_slope(residual: FloatArray) -> FloatArray:
    square = (residual / _CAUCHY) ** 2
    return np.asarray((1 - square) / (1 + square) ** 2)


LINEAR = Loss("linear", _one, _one)
_ALL = (LINEAR, Loss("huber", _huber, _huber_slope), Loss("cauchy", _cauchy, _cauchy_slope))
LOSSES: Mapping[str, Loss] = MappingProxyType({loss.name: loss for loss in _ALL})


def loss_named(name: str) -> Loss:
    """Return the loss of that name.

    Raises
    ------
    InputError
        There is none.
    """
    if name not in LOSSES:
        raise InputError(f"no loss is called '{name}'; choose one of {', '.join(LOSSES)}")
    return LOSSES[name]
