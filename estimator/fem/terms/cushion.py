"""Something below the tissue that pushes it up until it has risen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.fem.assembly.body import Response
from estimator.fem.terms.term import Memoryless, TermStiffness

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Cushion(Memoryless):
    """Springs that push nodes along z and never pull.

    Attributes
    ----------
    springs : (n,) stiffness at each node, N/m
    height_m : displacement along z from which on nothing pushes
    """

    springs: FloatArray
    height_m: float

    def forces(self, displacement: FloatArray, response: Response) -> FloatArray:
        """Return the nodal forces (n, 3), N, as they join the internal ones."""
        forces = np.zeros_like(displacement)
        forces[:, 2] = -self.springs * np.maximum(self.height_m - displacement[:, 2], 0.0)
        return forces

    def stiffness(self, displacement: FloatArray, response: Response) -> TermStiffness:
        """Return the stiffness of the springs that push."""
        nodes = np.zeros((len(displacement), 3, 3))
        nodes[:, 2, 2] = np.where(displacement[:, 2] < self.height_m, self.springs, 0.0)
        return TermStiffness(nodes=nodes)
