"""Rows that are off by themselves: beads that shake together, images that are out of step.

No smooth misfit explains them. Each row then is off by an amplitude of its own along the directions D of the whitened
misfit r, whose covariance is K + s² D Dᵀ. Where the beads' own noise is σ times what was stated, and the errors that
values share are as stated, K = 1 − (1 − σ²) S P S: S reduces what values share, P picks the beads. σ is taken from the
part of r that holds nothing shared. With an orthonormal basis Q of D, the root L of Qᵀ K Q, the eigenvalues λ and
eigenvectors V of L⁻¹ Qᵀ D Dᵀ Q L⁻ᵀ, and q = Vᵀ L⁻¹ Qᵀ r,

    ln p(Qᵀ r | s) − ln p(Qᵀ r | 0) = ½ Σ (q² s²λ / (1 + s²λ) − ln(1 + s²λ)),

the marginal likelihood of a Gaussian process (Rasmussen & Williams 2006, eq. 2.30) less that of noise alone, of what r
shows along D. Noise below the stated one counts as stated.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from estimator.diagnosis.noise.estimation import robust_deviation
from estimator.diagnosis.settings import EvidenceSettings
from estimator.inference.laplace import log_mean
from estimator.inference.whitening import Whitening, shrunk

FloatArray = NDArray[np.float64]

_WRENCH = 6
_LEAST_LEFT = 0.1  # of a value's variance, beside the errors that values share


def evidence_of_unsteadiness(
    residual: Sequence[FloatArray],
    whitenings: Sequence[Whitening],
    predicted: Sequence[FloatArray],
    settings: EvidenceSettings,
) -> float:
    """Return by how much the log evidence of a fit rises where single rows may be off, over all amplitudes.

    Where no bead was seen that is nothing.

    Parameters
    ----------
    residual : (r,) of each experiment, whitened
    whitenings : by which
    predicted : (n, 6 + 3m) of each experiment, channels of the fit
    settings : by what rows may be off, of each bead that shakes, or of the fastest that is seen too early or too late
    """
    own = np.concatenate([_own_noise_of_beads(r, w) for r, w in zip(residual, whitenings, strict=True)])
    if not len(own):
        return 0.0
    noise = _noise(own, settings.noise_as_stated)
    amplitudes = np.array(settings.rows_off)
    found = []
    for directions_of in (_together, _along_paths):
        squares, eigenvalues = [], []
        for r, whitening, channels in zip(residual, whitenings, predicted, strict=True):
            directions = whitening.apply(directions_of(whitening, channels, settings.slowest_rows))
            q, grown = _in_units_of_noise(r, directions, whitening, noise)
            squares.append(q**2)
            eigenvalues.append(grown)
        q_squared, excess = np.concatenate(squares), np.outer(amplitudes**2, np.concatenate(eigenvalues))
        found.append(0.5 * np.sum(q_squared * excess / (1.0 + excess) - np.log1p(excess), axis=1))
    return log_mean(np.concatenate(found))


def _noise(own: FloatArray, as_stated: float) -> float:
    """Return the noise of a bead in units of the stated one, which it is unless beads show more beyond chance.

    Where they show less, what was stated is more than scatter: what stays within it needs no cause.
    """
    shown = robust_deviation(own)
    return shown if shown > 1.0 + as_stated else 1.0


def _own_noise_of_beads(residual: FloatArray, whitening: Whitening) -> FloatArray:
    """Return what beads show beside the errors that values share, with the deviation of their own noise.

    What lies almost wholly along shared errors tells nothing of it.
    """
    outside = shrunk(residual[:, None], whitening.vectors, np.ones(len(whitening.shrink)))[:, 0]
    left = 1.0 - np.sum(whitening.vectors**2, axis=1)
    telling = _is_of_bead(whitening) & (left > _LEAST_LEFT)
    return np.asarray(outside[telling] / np.sqrt(left[telling]))


def _in_units_of_noise(
    residual: FloatArray, directions: FloatArray, whitening: Whitening, noise: float
) -> tuple[FloatArray, FloatArray]:
    """Return q and λ of a whitened misfit (r,) along whitened directions (r, k); ``noise`` is that of beads."""
    values, vectors = np.linalg.eigh(directions.T @ directions)
    kept = values > 1e-9 * max(float(values.max(initial=0.0)), 1e-300)
    along, size = directions @ (vectors[:, kept] / np.sqrt(values[kept])), values[kept]
    own = shrunk(along, whitening.vectors, whitening.shrink)[_is_of_bead(whitening)]
    root = np.linalg.cholesky(np.eye(len(size)) - (1.0 - noise**2) * own.T @ own)
    scaled = solve_triangular(root, np.diag(np.sqrt(size)), lower=True)
    left, singular, _ = np.linalg.svd(scaled)
    q = left.T @ solve_triangular(root, along.T @ residual, lower=True)
    return np.asarray(q), np.asarray(singular**2)


def _is_of_bead(whitening: Whitening) -> NDArray[np.bool_]:
    """Tell which whitened values (r,) are a bead's."""
    return np.asarray(np.nonzero(whitening.seen)[1] >= _WRENCH)


def _together(whitening: Whitening, predicted: FloatArray, slowest: int) -> FloatArray:
    """Return directions (n, c, k), m, in which all beads of a row are aside by their noise along one axis."""
    rows, channels = predicted.shape
    quick = _quick(rows, slowest)
    found = np.zeros((rows, channels, 3, quick.shape[1]))
    for axis in range(3):
        own = np.where((np.arange(channels) - _WRENCH) % 3 == axis, whitening.deviation, 0.0)
        own[:_WRENCH] = 0.0
        found[:, :, axis] = own[None, :, None] * quick[:, None, :]
    return found.reshape(rows, channels, -1)


def _along_paths(whitening: Whitening, predicted: FloatArray, slowest: int) -> FloatArray:
    """Return directions (n, c, k), m, in which a row's beads are ahead on their paths, the fastest by its noise."""
    velocity = np.gradient(predicted, axis=0)
    velocity[:, :_WRENCH] = 0.0
    fastest = max(float(np.abs(velocity / whitening.deviation).max()), np.finfo(float).tiny)
    return np.asarray((velocity / fastest)[:, :, None] * _quick(len(predicted), slowest)[:, None, :])


def _quick(rows: int, slowest: int) -> FloatArray:
    """Return an orthonormal basis (n, k) of what changes faster than over so many rows.

    A model misses what is slower, and so does a camera that is late throughout.
    """
    order = np.arange(2 * rows // slowest, rows)
    waves = np.cos(np.pi * np.outer(np.arange(rows) + 0.5, order) / rows)
    return np.asarray(waves / np.linalg.norm(waves, axis=0))
