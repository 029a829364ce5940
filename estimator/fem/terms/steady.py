"""Forces on nodes that remember nothing: springs to where the nodes were at rest, and loads that do not change."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.fem.assembly.body import Response
from estimator.fem.terms.term import Memoryless, TermStiffness

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class NodalSprings(Memoryless):
    """Springs between nodes and their rest positions: symmetric stiffnesses (n, 3, 3), N/m."""

    springs: FloatArray

    def forces(self, displacement: FloatArray, response: Response) -> FloatArray:
        """Return the forces (n, 3), N, with which the springs are stretched."""
        return np.einsum("nij,nj->ni", self.springs, displacement)

    def stiffness(self, displacement: FloatArray, response: Response) -> TermStiffness:
        """Return the springs' stiffness."""
        return TermStiffness(nodes=self.springs)


@dataclass(frozen=True, eq=False)
class DeadLoad(Memoryless):
    """Forces (n, 3), N, that act on the nodes whatever they do, such as their weight."""

    load: FloatArray

    def forces(self, displacement: FloatArray, response: Response) -> FloatArray:
        """Return the load, as it joins the internal forces."""
        return -self.load

    def stiffness(self, displacement: FloatArray, response: Response) -> TermStiffness:
        """Return that of a constant: none."""
        return TermStiffness()
