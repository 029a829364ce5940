"""A viscous film below the tissue: its friction grows with the speed at which the tissue slides over it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.fem.assembly.body import Response
from estimator.fem.terms.term import BeginsAnew, TermStiffness

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ViscousFilm(BeginsAnew):
    """A film that drags at each node by its horizontal speed since the last state (implicit Euler).

    Attributes
    ----------
    drag : (n,) ≥ 0, force per speed of each node, N·s/m
    last : (n, 2) where each node was, m from its place at rest
    seconds : since then; nothing drags where no time has passed
    """

    drag: FloatArray
    last: FloatArray
    seconds: float = 0.0

    @classmethod
    def at_rest(cls, drag: FloatArray) -> ViscousFilm:
        """Return the film below tissue that has not moved yet."""
        return cls(drag, np.zeros((len(drag), 2)))

    def forces(self, displacement: FloatArray, response: Response) -> FloatArray:
        """Return the forces (n, 3), N, that the tissue's motion has to overcome."""
        moved = displacement[:, :2] - self.last
        return np.column_stack([self._by_way[:, None] * moved, np.zeros(len(moved))])

    def stiffness(self, displacement: FloatArray, response: Response) -> TermStiffness:
        """Return the derivative of :meth:`forces`."""
        blocks: FloatArray = np.zeros((len(displacement), 3, 3))
        blocks[:, :2, :2] = self._by_way[:, None, None] * np.eye(2)
        return TermStiffness(nodes=blocks)

    def starting_after(self, seconds: float) -> ViscousFilm:
        """Return the film for a state that follows the last one after some time."""
        return replace(self, seconds=seconds)

    def after(self, displacement: FloatArray, response: Response) -> ViscousFilm:
        """Return the film once a state has been reached."""
        return replace(self, last=displacement[:, :2].copy(), seconds=0.0)

    def rested(self) -> ViscousFilm:
        """Return the film below tissue that is at rest where it was laid down."""
        return self.at_rest(self.drag)

    @property
    def _by_way(self) -> FloatArray:
        """Force (n,) by the way since the last state, N/m."""
        return self.drag / self.seconds if self.seconds > 0.0 else np.zeros_like(self.drag)
