"""How probable the measurements are under a hypothesis whose parameters are free: Laplace's approximation.

With residual r and derivatives Z at parameters θ̂, both whitened, and Gaussian priors on the amplitudes,

    ln p(y | j) = −½ min_δ (‖r − Z δ‖² + prior) − ½ ln det(I + T Zᵀ M Z T) − ½ ln det S,

M projecting out what is common to all hypotheses (E and ν, with a flat prior or a weak one), T the prior deviations,
and S the covariance by which residual and derivatives were whitened further.

How large an effect is spans decades, and its amplitudes are large or small together: their prior is a mixture of
normals from the usual size down. With the usual size alone an effect of three components that is a thirtieth of it
would pay ln 30 for each of them. What would be too small to show counts as no effect at all: of each size the share
d² / (d² + 2²) is believed, d being by how many deviations of the noise, less what E and ν can imitate, it stands out.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from estimator.inference.bounded_minimum import bounded_minimum
from estimator.inference.free_parameter import FreeParameter

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Priors:
    """What is known of a hypothesis' parameters beforehand: E and ν first, then k others.

    Attributes
    ----------
    common : (2 + k,) bool, what every hypothesis has: E and ν
    centre : (2 + k,) where the parameters stand in units of their priors; 0 where these are flat
    scale : (2 + k,) prior deviations; infinite where they are flat
    lower, upper : (2 + k,) how far each parameter may go from here
    amplitude_of : (2 + k,) the number of the effect whose amplitude it is; -1 for what is no amplitude
    size_grid : sizes of an effect as shares of its usual one, equally likely
    shows : by how many deviations of the noise an effect stands out that shows as often as not
    """

    common: NDArray[np.bool_]
    centre: FloatArray
    scale: FloatArray
    lower: FloatArray
    upper: FloatArray
    amplitude_of: NDArray[np.int64]
    size_grid: tuple[float, ...]
    shows: float

    @classmethod
    def of(
        cls,
        free: Sequence[FreeParameter],
        common: Sequence[bool],
        amplitude_of: Sequence[int],
        size_grid: tuple[float, ...],
        shows: float,
    ) -> Priors:
        """Return the priors of free parameters at their present values, and their bounds as seen from there."""
        scale = np.array([parameter.prior_scale for parameter in free])
        lower, upper = np.array([parameter.limits for parameter in free]).T
        centre = np.array([parameter.prior_offset for parameter in free])
        return cls(np.array(common), centre, scale, lower, upper, np.array(amplitude_of), size_grid, shows)

    def within(self, reach: FloatArray) -> Priors:
        """Return the priors where no parameter may go farther than its reach (2 + k,)."""
        return replace(self, lower=np.maximum(self.lower, -reach), upper=np.minimum(self.upper, reach))

    @cached_property
    def sizes(self) -> FloatArray:
        """Sizes (s, 2 + k) that the effects may have, as shares of the usual one; 1 for what has no size."""
        effects = self._effects
        shares = np.array(list(itertools.product(self.size_grid, repeat=len(effects))))
        found = np.ones((len(shares), len(self.scale)))
        for own, share in zip(effects, shares.T, strict=True):
            found[:, own] = share[:, None]
        return found

    def believed(self, information: FloatArray) -> FloatArray:
        """Return the log of the share (s,) of each size that is believed.

        ``information`` (2 + k)² is the Gram matrix of the derivatives.
        """
        squared = self._standing_out(information) * self.sizes**2
        standing = np.array([squared[:, own].sum(axis=1) for own in self._effects])
        return np.asarray(np.sum(np.log(np.maximum(standing, 1e-300) / (standing + self.shows**2)), axis=0))

    @cached_property
    def _effects(self) -> list[NDArray[np.bool_]]:
        """For each effect which parameters (2 + k,) are its amplitudes."""
        return [
            self.amplitude_of == effect for effect in np.unique(self.amplitude_of[self.amplitude_of >= 0])
        ]

    def _standing_out(self, information: FloatArray) -> FloatArray:
        """Return the square (2 + k,) by which one prior deviation of each amplitude stands out of noise, E and ν."""
        common, rest = self.common, self.amplitude_of >= 0
        found = np.zeros(len(self.scale))
        cross = information[np.ix_(rest, common)]
        of_common = information[np.ix_(common, common)] + np.diag(self.inverse_scale[common] ** 2)
        imitated = np.einsum("rf,rf->r", cross, np.linalg.solve(of_common, cross.T).T)
        found[rest] = np.maximum(np.diag(information)[rest] - imitated, 0.0) * self.scale[rest] ** 2
        return found

    @property
    def inverse_scale(self) -> FloatArray:
        """Inverse of the prior deviations (2 + k,); 0 where the prior is flat."""
        return np.where(np.isinf(self.scale), 0.0, 1.0 / self.scale)


def log_mean(log_values: Sequence[float] | FloatArray) -> float:
    """Return the logarithm of the mean of values whose logarithms are given: each is as likely as the others."""
    return float(np.logaddexp.reduce(np.asarray(log_values)) - np.log(len(log_values)))


def evidence_of_gram(gram: FloatArray, priors: Priors) -> float:
    """Return ln p(y | hypothesis) from the Gram matrix (1 + 2 + k)² of residual and derivatives, over all sizes."""
    information, sizes, own = gram[1:, 1:], priors.sizes, ~priors.common
    centre, inverse = priors.centre / sizes, priors.inverse_scale / sizes
    posterior = information + inverse[:, :, None] ** 2 * np.eye(len(information))
    unit = np.sqrt(np.diagonal(posterior, axis1=1, axis2=2))
    scaled = posterior / (unit[:, :, None] * unit[:, None, :])
    step = np.linalg.solve(scaled, ((gram[1:, 0] - inverse * centre) / unit)[:, :, None])[:, :, 0] / unit
    for number in np.flatnonzero(np.any((step < priors.lower) | (step > priors.upper), axis=1)):
        pull = gram[1:, 0] - inverse[number] * centre[number]
        step[number] = bounded_minimum(posterior[number], pull, priors.lower, priors.upper)
    misfit = gram[0, 0] - 2 * step @ gram[1:, 0] + np.einsum("si,ij,sj->s", step, information, step)
    prior = np.sum((centre + inverse * step) ** 2, axis=1)
    # det of the Schur complement of what is common in the posterior, times that of the priors
    _, occam = np.linalg.slogdet(posterior)
    occam -= np.linalg.slogdet(posterior[0][np.ix_(priors.common, priors.common)])[1]
    occam -= 2 * np.sum(np.log(inverse[:, own]), axis=1)
    # A one-sided amplitude has a half-normal prior, twice as dense.
    one_sided = np.isfinite(priors.lower[own]) ^ np.isfinite(priors.upper[own])
    values = -0.5 * (misfit + prior + occam) + np.log(2.0) * one_sided.sum()
    return log_mean(values + priors.believed(information))
