"""How probable the measurements are under a hypothesis whose parameters are free: Laplace's approximation.

With residual r and derivatives Z at parameters θ̂, both whitened, and Gaussian priors on the amplitudes,

    ln p(y | j) = −½ min_δ (‖r − Z δ‖² + prior) − ½ ln det(I + T Zᵀ M Z T) − ½ ln det S,

M projecting E and ν out (their prior is flat and common to all hypotheses), T the prior deviations, and S the
covariance of a discrepancy that forgives the signature its inexactness. Its amplitude is integrated over a grid.

How large an effect is spans decades, and its amplitudes are large or small together: their prior is a mixture of
normals from the usual size down. With the usual size alone an effect of three components that is a thirtieth of it
would pay ln 30 for each of them. What would be too small to show counts as no effect at all: of each size the share
d² / (d² + 2²) is believed, d being by how many deviations of the noise, less what E and ν can imitate, it stands out.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.optimize import lsq_linear
from scipy.special import logsumexp

from estimator.diagnosis.discrepancy import ModelError, Moments, forgiven

FloatArray = NDArray[np.float64]

# Amplitudes of an unexplained misfit beyond the floor, in units of one value's noise.
UNKNOWN = tuple(
    (w, f)
    for w in (0.05, 0.3, 1.0, 3.0, 10.0, 30.0)
    for f in (0.05, 0.3, 1.0, 3.0, 10.0, 30.0)
    if max(w, f) > 0.1
)
# Shares of the largest floor of what every model misses, of which the measurements choose.
_FLOOR_SHARES = (1.0, 0.3, 0.1, 0.03, 0.01)
# Inexactness of a signature, as a share of what the effect explains.
_INEXACT = (0.0, 0.02, 0.05, 0.1)
# Sizes of an effect as shares of its usual one, equally likely.
_SIZES = (1.0, 0.3, 0.1, 0.03)
# What stands out by so many deviations of the noise shows as often as not.
_SHOWS = 2.0


@dataclass(frozen=True)
class Priors:
    """What is known of a hypothesis' parameters beforehand: E and ν first, then k others.

    Attributes
    ----------
    centre : (2 + k,) where the parameters stand in units of their priors; 0 for E and ν
    scale : (2 + k,) prior deviations; infinite for E and ν
    lower, upper : (2 + k,) how far each parameter may go from here
    amplitude_of : (2 + k,) the number of the effect whose amplitude it is; -1 for what is no amplitude
    """

    centre: FloatArray
    scale: FloatArray
    lower: FloatArray
    upper: FloatArray
    amplitude_of: NDArray[np.int64]

    def of_every_size(self, information: FloatArray) -> list[tuple[float, Priors]]:
        """Return the priors with every effect of each size, from the usual one down, and how much each is believed.

        ``information`` (2 + k)² is the Gram matrix of the derivatives.
        """
        effects = np.unique(self.amplitude_of[self.amplitude_of >= 0])
        stands_out = self._standing_out(information)
        found = []
        for sizes in itertools.product(_SIZES, repeat=len(effects)):
            size, believed = np.ones(len(self.scale)), 1.0
            for effect, share in zip(effects, sizes, strict=True):
                own = self.amplitude_of == effect
                size[own] = share
                squared = share**2 * float(stands_out[own].sum())
                believed *= squared / (squared + _SHOWS**2)
            found.append((believed, replace(self, centre=self.centre / size, scale=self.scale * size)))
        return found

    def _standing_out(self, information: FloatArray) -> FloatArray:
        """Return the square (2 + k,) by which one prior deviation of each amplitude stands out of noise, E and ν."""
        free, rest = np.isinf(self.scale), self.amplitude_of >= 0
        found = np.zeros(len(self.scale))
        cross = information[np.ix_(rest, free)]
        imitated = np.einsum("rf,rf->r", cross, np.linalg.solve(information[np.ix_(free, free)], cross.T).T)
        found[rest] = np.maximum(np.diag(information)[rest] - imitated, 0.0) * self.scale[rest] ** 2
        return found

    @property
    def inverse_scale(self) -> FloatArray:
        """Inverse of the prior deviations (2 + k,); 0 for E and ν."""
        return np.where(np.isinf(self.scale), 0.0, 1.0 / self.scale)


def log_evidence(
    moments: Moments, priors: Priors, error: ModelError, amplitude: tuple[float, float]
) -> float:
    """Return ln p(y | hypothesis) up to a constant, with a discrepancy of given amplitude.

    ``moments`` are those of the residual and, after it, of the derivatives by the parameters.
    """
    gram, log_determinant = forgiven(error, moments, amplitude)
    return evidence_of_gram(gram, priors) - 0.5 * log_determinant


def evidence_of_gram(gram: FloatArray, priors: Priors) -> float:
    """Return ln p(y | hypothesis) from the Gram matrix (1 + 2 + k)² of residual and derivatives, over all sizes."""
    sizes = priors.of_every_size(gram[1:, 1:])
    values = [_evidence_at_size(gram, sized) for _, sized in sizes]
    return float(logsumexp(values, b=[believed for believed, _ in sizes]) - np.log(len(sizes)))


def _evidence_at_size(gram: FloatArray, priors: Priors) -> float:
    chi2, gradient, information = gram[0, 0], gram[1:, 0], gram[1:, 1:]
    free = np.isinf(priors.scale)
    inverse = priors.inverse_scale
    posterior = information + np.diag(inverse**2)
    pull = gradient - inverse * priors.centre
    step = bounded_minimum(posterior, pull, priors.lower, priors.upper)
    misfit = chi2 - 2 * gradient @ step + step @ information @ step
    prior = float(np.sum((priors.centre + inverse * step) ** 2))
    occam = 0.0
    if not free.all():
        schur = posterior[np.ix_(~free, ~free)]
        cross = posterior[np.ix_(~free, free)]
        schur = schur - cross @ np.linalg.solve(posterior[np.ix_(free, free)], cross.T)
        t = priors.scale[~free]
        _, occam = np.linalg.slogdet(schur * np.outer(t, t))
        # A one-sided amplitude has a half-normal prior, twice as dense.
        one_sided = np.isfinite(priors.lower[~free]) ^ np.isfinite(priors.upper[~free])
        occam -= 2 * np.log(2.0) * one_sided.sum()
    return float(-0.5 * (misfit + prior + occam))


def bounded_minimum(A: FloatArray, b: FloatArray, lower: FloatArray, upper: FloatArray) -> FloatArray:
    """Return the minimiser x of ½ xᵀAx − bᵀx with lower ≤ x ≤ upper, for A positive definite.

    Where the free minimum lies beyond a bound it is that of the bounded least squares of A's root.
    """
    scale = np.sqrt(np.maximum(np.diag(A), 1e-300))
    root = np.linalg.cholesky(A / np.outer(scale, scale) + 1e-10 * np.eye(len(A)))
    target = solve_triangular(root, b / scale, lower=True)
    free = solve_triangular(root, target, lower=True, trans="T") / scale
    if np.all((lower <= free) & (free <= upper)):
        return np.asarray(free)
    lo, hi = np.minimum(lower * scale, 0.0), np.maximum(upper * scale, 0.0)
    stuck = hi - lo <= 0.0
    hi = np.where(stuck, lo + 1e-300, hi)
    return np.asarray(lsq_linear(root.T, target, (lo, hi), method="bvls").x / scale)


def marginal_evidence(
    moments: Moments, priors: Priors, error: ModelError, explained: FloatArray
) -> tuple[float, tuple[float, float]]:
    """Integrate the evidence of a named hypothesis over the inexactness of its signature.

    Parameters
    ----------
    explained : (2,) root mean square of what the effect explains in wrench and fiducials, units of one value's noise

    Returns
    -------
    log_evidence : float
    inexactness : the most probable amplitude of what it misses, in wrench and fiducials
    """
    found = {}
    for share in _INEXACT:
        wrench, fiducials = (
            float(np.hypot(f, share * e)) for f, e in zip(error.floor, explained, strict=True)
        )
        found[wrench, fiducials] = log_evidence(moments, priors, error, (wrench, fiducials))
    values = list(found.values())
    return float(logsumexp(values) - np.log(len(values))), max(found, key=lambda key: found[key])


def with_floor_borne_out(error: ModelError, moments: Moments, priors: Priors) -> ModelError:
    """Return a model error whose floor is the share of its largest one that the baseline's misfit makes most probable.

    Sensors better than the model is taken to be would else show a misfit smaller than the floor, and something
    unknown with a smaller amplitude would be the better explanation of nothing at all.
    """
    shares = itertools.product(_FLOOR_SHARES, repeat=2)
    floors = [(w * error.floor[0], f * error.floor[1]) for w, f in shares]
    return replace(error, floor=max(floors, key=lambda floor: log_evidence(moments, priors, error, floor)))


def unknown_evidence(moments: Moments, priors: Priors, error: ModelError) -> float:
    """Return the evidence of a smooth misfit of any size beyond the floor."""
    wrench, fiducials = error.floor
    found = [
        log_evidence(moments, priors, error, (float(np.hypot(wrench, w)), float(np.hypot(fiducials, f))))
        for w, f in UNKNOWN
    ]
    return float(logsumexp(found) - np.log(len(found)))
