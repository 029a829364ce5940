"""Rows that are off by themselves: beads that shake together, images that are out of step.

No smooth misfit explains them. The whitened misfit r of a fit then is normal with the covariance σ² (1 + s² D Dᵀ): each
row is off by an amplitude of its own along the directions D, and σ is the noise as most beads show it. With the
eigenvalues λ and eigenvectors V of DᵀD, and q = λ^−½ Vᵀ Dᵀ r,

    ln p(r | s) − ln p(r | 0) = ½ Σ (q²/σ² s²λ / (1 + s²λ) − ln(1 + s²λ)),

the marginal likelihood of a Gaussian process (Rasmussen & Williams 2006, eq. 2.30) less that of noise alone.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.noise.estimation import robust_deviation
from estimator.diagnosis.settings import EvidenceSettings
from estimator.inference.laplace import log_mean
from estimator.inference.whitening import Whitening

FloatArray = NDArray[np.float64]

_WRENCH = 6


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
    of_beads = np.concatenate([_of_beads(r, w) for r, w in zip(residual, whitenings, strict=True)])
    if not len(of_beads):
        return 0.0
    noise = _noise(of_beads, settings.noise_as_stated)
    amplitudes = np.array(settings.rows_off)
    found = []
    for directions_of in (_together, _along_paths):
        squares, eigenvalues = [], []
        for r, whitening, channels in zip(residual, whitenings, predicted, strict=True):
            directions = whitening.apply(directions_of(whitening, channels, settings.slowest_rows))
            values, vectors = np.linalg.eigh(directions.T @ directions)
            kept = values > 1e-9 * max(float(values.max(initial=0.0)), 1e-300)
            squares.append((vectors.T @ (directions.T @ r))[kept] ** 2 / values[kept] / noise**2)
            eigenvalues.append(values[kept])
        q, grown = np.concatenate(squares), np.outer(amplitudes**2, np.concatenate(eigenvalues))
        found.append(0.5 * np.sum(q * grown / (1.0 + grown) - np.log1p(grown), axis=1))
    return log_mean(np.concatenate(found))


def _noise(of_beads: FloatArray, as_stated: float) -> float:
    """Return the noise of a bead in units of the stated one, which it is unless beads show another beyond chance."""
    shown = robust_deviation(of_beads)
    return shown if abs(shown - 1.0) > as_stated else 1.0


def _of_beads(residual: FloatArray, whitening: Whitening) -> FloatArray:
    return residual[np.nonzero(whitening.seen)[1] >= _WRENCH]


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
