"""The minimum of a quadratic function within bounds: the step of every Gauss-Newton iteration."""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.optimize import lsq_linear

FloatArray = NDArray[np.float64]


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
    beyond = np.flatnonzero((free < lower) | (free > upper))
    if len(beyond) == 1:
        # Where one bound alone is passed the minimum lies on it, unless another is passed then.
        on = np.clip(free, lower, upper)
        rest = np.flatnonzero(np.arange(len(b)) != beyond[0])
        on[rest] = np.linalg.solve(A[np.ix_(rest, rest)], b[rest] - A[rest, beyond[0]] * on[beyond[0]])
        if np.all((lower <= on) & (on <= upper)):
            return np.asarray(on)
    lo, hi = np.minimum(lower * scale, 0.0), np.maximum(upper * scale, 0.0)
    stuck = hi - lo <= 0.0
    hi = np.where(stuck, lo + 1e-300, hi)
    return np.asarray(lsq_linear(root.T, target, (lo, hi), method="bvls").x / scale)
