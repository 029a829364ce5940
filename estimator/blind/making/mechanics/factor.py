"""The sum of cell tangents over the free degrees of freedom, factorised by CHOLMOD."""

import numpy as np
from kvxopt import cholmod, matrix, spmatrix
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class NotPositiveDefiniteError(ArithmeticError):
    """The tangent belongs to no stable state; take a smaller step."""


class FreeStiffness:
    """Sums and factorises tangents of one mesh and one set of free degrees of freedom.

    Parameters
    ----------
    dofs : (e, d) degrees of freedom of each cell
    free : (n,) True where a degree of freedom is free
    """

    def __init__(self, dofs: IntArray, free: NDArray[np.bool_]) -> None:
        number = np.full(len(free), -1)
        number[free] = np.arange(free.sum())
        local = number[dofs]
        width = local.shape[1]
        rows = np.repeat(local, width, axis=1).reshape(-1)
        columns = np.tile(local, (1, width)).reshape(-1)
        self._kept = np.flatnonzero((columns >= 0) & (rows >= columns))
        self.size = int(free.sum())
        keys, self._place = np.unique(columns[self._kept] * self.size + rows[self._kept], return_inverse=True)
        self._matrix = spmatrix(
            1.0, matrix(keys % self.size), matrix(keys // self.size), (self.size, self.size)
        )
        self._entries = len(keys)
        self._factor = cholmod.symbolic(self._matrix)

    def factorise(self, stiffness: FloatArray) -> None:
        """Sum cell tangents (e, d, d) and factorise them.

        Raises
        ------
        NotPositiveDefiniteError
            The sum is not positive definite.
        """
        values = np.bincount(self._place, stiffness.reshape(-1)[self._kept], self._entries)
        self._matrix.V = matrix(values)
        try:
            cholmod.numeric(self._matrix, self._factor)
            # A supernodal factor that failed says so only when it is used.
            self.solve(np.zeros(self.size))
        except ArithmeticError:
            raise NotPositiveDefiniteError("the tangent is not positive definite") from None

    def solve(self, right: FloatArray) -> FloatArray:
        """Solve for one or several right-hand sides, (n,) or (n, m), by the latest factor."""
        unknowns = matrix(np.asfortranarray(right.reshape(self.size, -1)))
        cholmod.solve(self._factor, unknowns)
        return np.array(unknowns).reshape(right.shape)
