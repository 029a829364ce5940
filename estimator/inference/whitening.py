"""Whitening: the inverse root of the covariance of what was measured, with errors that values share.

A row's channels carry the sensors' noise, white or correlated with that of the row before. On top of it lie errors
that many values share. With these as U η, η ~ N(0, 1), and the white part scaled to one, the covariance is I + U Uᵀ,
and its inverse root is I − Q (1 − (1 + λ)^−½) Qᵀ with the singular vectors Q and squared singular values λ of U.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Whitening:
    """The inverse root of the covariance of some rows.

    Attributes
    ----------
    seen : (n, c) bool, what was measured
    deviation : (c,) standard deviation of one value
    correlation : (c,) of one value's noise with that of the row before
    vectors : (r, k) orthonormal, over the measured values
    shrink : (k,) 1 − (1 + λ)^−½
    """

    seen: NDArray[np.bool_]
    deviation: FloatArray
    correlation: FloatArray
    vectors: FloatArray
    shrink: FloatArray

    def apply(self, columns: FloatArray) -> FloatArray:
        """Whiten columns (n, c, k) to (r, k)."""
        scaled = uncorrelated(columns / self.deviation[:, None], self.seen, self.correlation)
        return shrunk(scaled, self.vectors, self.shrink)

    def anew(self, columns: FloatArray, before: "Whitening") -> FloatArray:
        """Whiten columns (r, k) that were whitened before, by a whitening of other shared errors alone."""
        return shrunk(before.with_shared(columns), self.vectors, self.shrink)

    def root(self) -> FloatArray:
        """Return the root (r, r) of the covariance of what was seen, of rows without correlation."""
        deviation = np.broadcast_to(self.deviation, self.seen.shape)[self.seen]
        return np.asarray(deviation[:, None] * self.with_shared(np.eye(len(deviation))))

    def derivative(self, by_whitened: FloatArray) -> FloatArray:
        """Return the derivative (p, n, c) by each value of what has this one (p, r) by the whitened values.

        It is for rows without correlation, and zero for what was not measured.
        """
        by_value = np.zeros((len(by_whitened), *self.seen.shape))
        by_value[:, self.seen] = shrunk(by_whitened.T, self.vectors, self.shrink).T
        return by_value / self.deviation

    def undo(self, whitened: FloatArray) -> FloatArray:
        """Return the channels (n, c) whose whitened values these (r,) are; NaN where nothing was measured."""
        channels = np.full(self.seen.shape, np.nan)
        channels[self.seen] = self.with_shared(whitened[:, None])[:, 0]
        before, weight = _before(self.seen, self.correlation)
        for row in range(len(channels)):
            last = np.where(weight[row] > 0, channels[before[row], np.arange(len(self.deviation))], 0.0)
            channels[row] = np.sqrt(1.0 - weight[row] ** 2) * channels[row] + weight[row] * last
        return channels * self.deviation

    def with_shared(self, whitened: FloatArray) -> FloatArray:
        """Return whitened columns (r, k) with the shared errors in them again: what was shrunk grows back."""
        return shrunk(whitened, self.vectors, -self.shrink / (1.0 - self.shrink))

    @property
    def floor(self) -> float:
        """Root mean square of a whitened residual that holds white noise alone, none of the shared errors."""
        return float(np.sqrt(1.0 - np.sum(1.0 - (1.0 - self.shrink) ** 2) / len(self.vectors)))

    @property
    def shared_variance(self) -> FloatArray:
        """Variance (r,) of each measured value by the errors that values share, that of white noise being one."""
        return np.asarray(self.vectors**2 @ ((1.0 - self.shrink) ** -2 - 1.0))

    @property
    def log_determinant(self) -> float:
        """Logarithm of the determinant of I + U Uᵀ."""
        return float(-2.0 * np.log1p(-self.shrink).sum())

    def residual(self, measured: FloatArray, predicted: FloatArray) -> FloatArray:
        """Return the whitened misfit (r,) of channels (n, c), measured less predicted."""
        error = np.where(self.seen, measured - predicted, 0.0)
        return self.apply(error[:, :, None])[:, 0]


def uncorrelated(columns: FloatArray, seen: NDArray[np.bool_], correlation: FloatArray) -> FloatArray:
    """Return columns (n, c, k) at what was seen, (r, k), free of the correlation (c,) of each row with the one before.

    The first-order autoregression's innovations, (x_t - w x_s) / (1 - w²)^½, s being the last row seen before t and
    w the correlation to the power of their distance.
    """
    if not correlation.any():
        return np.asarray(columns[seen])
    before, weight = _before(seen, correlation)
    w = weight[:, :, None]
    last = np.take_along_axis(columns, np.broadcast_to(before[:, :, None], columns.shape), axis=0)
    last = np.where(w > 0, last, 0.0)
    return np.asarray(((columns - w * last) / np.sqrt(1.0 - w**2))[seen])


def _before(seen: NDArray[np.bool_], correlation: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
    """Return for each value the last row (n, c) before it that was seen, and the correlation with it, 0 for none."""
    rows = np.arange(len(seen))[:, None]
    latest = np.maximum.accumulate(np.where(seen, rows, -1), axis=0)
    before = np.vstack([np.full((1, seen.shape[1]), -1), latest[:-1]])
    weight = np.where(before >= 0, correlation ** (rows - before), 0.0)
    return np.maximum(before, 0), weight


def shrunk(columns: FloatArray, vectors: FloatArray, shrink: FloatArray) -> FloatArray:
    """Return columns (r, k) with their part along orthonormal vectors (r, q) reduced by the shares ``shrink`` (q,)."""
    return columns - vectors @ (shrink[:, None] * (vectors.T @ columns))


def inverse_root(directions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (vectors, shrink) of (I + U Uᵀ)^−½ for U (r, k)."""
    return inverse_root_scaled(directions, np.ones(directions.shape[1]), directions.T @ directions)


def inverse_root_scaled(
    directions: FloatArray, scale: FloatArray, gram: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the same for directions (r, k) each times its ``scale`` (k,).

    ``gram`` (k, k) holds the inner products of the directions themselves: it serves any scale.
    """
    eigenvalues, eigenvectors = np.linalg.eigh(scale[:, None] * gram * scale)
    kept = eigenvalues > 1e-9 * max(float(eigenvalues.max(initial=0.0)), 1e-300)
    root = np.sqrt(eigenvalues[kept])
    vectors = directions @ (scale[:, None] * eigenvectors[:, kept] / root)
    return vectors, 1.0 - 1.0 / np.sqrt(1.0 + eigenvalues[kept])
