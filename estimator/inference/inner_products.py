"""Inner products of whitened columns where values share errors of several directions, each of any size.

With X (r, k) in units of the values' own noise, and the shared errors U S η, η ~ N(0, 1), the directions U (r, q) times
their sizes S, the covariance is I + U S² Uᵀ, and (M. Woodbury, 1950)

    Xᵀ (I + U S² Uᵀ)⁻¹ X = XᵀX − (S UᵀX)ᵀ (I + S UᵀU S)⁻¹ (S UᵀX),

so that for other sizes no value is looked at again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class InnerProducts:
    """Inner products of k columns and q directions of shared errors over values with independent noise.

    Attributes
    ----------
    of_columns : (k, k)
    of_directions : (q, q)
    across : (q, k), of directions with columns
    """

    of_columns: FloatArray
    of_directions: FloatArray
    across: FloatArray

    def whitened(self, sizes: FloatArray) -> tuple[FloatArray, float]:
        """Return the inner products (k, k) of the whitened columns, and the log determinant of the covariance.

        ``sizes`` (q,) are those of the shared errors.
        """
        inner = np.eye(len(sizes)) + sizes[:, None] * self.of_directions * sizes
        root = cholesky(inner, lower=True, overwrite_a=True, check_finite=False)
        along = solve_triangular(root, sizes[:, None] * self.across, lower=True, check_finite=False)
        return self.of_columns - along.T @ along, 2.0 * float(np.log(np.diag(root)).sum())


def columns_with(inner_products: FloatArray) -> FloatArray:
    """Return columns (k, k) that have these inner products (k, k) with each other: a few values stand for many."""
    length = np.sqrt(np.maximum(np.diag(inner_products), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(inner_products / np.outer(length, length))
    return np.asarray(np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T * length)
