"""A matrix that is not symmetric, because some forces follow others: a symmetric one with one of low rank beside it.

It is solved by the formula of Sherman, Morrison and Woodbury (W. W. Hager, SIAM Rev. 31 (1989) 221).
"""

from __future__ import annotations

from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lu_factor, lu_solve
from scipy.sparse import csr_array

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class Factor(Protocol):
    """The factor of a matrix (n, n)."""

    def solve(self, right_hand_sides: FloatArray) -> FloatArray:
        """Solve for (n,) or (n, m) right-hand sides."""
        ...


class FollowingFactor:
    """The factor of A + L B, where the symmetric A has one.

    Parameters
    ----------
    base : of A (n, n)
    along, by : L (n, r) and B (r, n)

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.sparse import csr_array
    >>> class Twofold:
    ...     def solve(self, right_hand_sides):
    ...         return right_hand_sides / 2
    >>> along, by = csr_array([[1.0], [0.0]]), csr_array([[0.0, 1.0]])
    >>> FollowingFactor(Twofold(), along, by).solve(np.array([3.0, 2.0])).tolist()
    [1.0, 1.0]
    """

    def __init__(self, base: Factor, along: csr_array, by: csr_array) -> None:
        self.base = base
        self._along, self._by = along, by

    def solve(self, right_hand_sides: FloatArray) -> FloatArray:
        """Solve for (n,) or (n, m) right-hand sides."""
        found = self.base.solve(right_hand_sides)
        answers, (small, pivots) = self._answers
        return np.asarray(found - answers @ lu_solve((small, pivots), self._by @ found))

    @cached_property
    def _answers(self) -> tuple[FloatArray, tuple[FloatArray, IntArray]]:
        """What the symmetric matrix answers (n, r) to each force, and the small matrix (r, r) factorised."""
        answers = self.base.solve(self._along.toarray())
        return answers, lu_factor(np.eye(answers.shape[1]) + self._by @ answers)
