"""Terms that rub on what holds the tissue: their forces follow its reaction, and they may ride on the gripper.

A term of this kind acts at nodes that a plate holds along its normal alone. What it bears along the plate grows with
what the plate presses with, which is the reaction of held degrees of freedom: no stiffness of single nodes has that.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from typing import Protocol, Self, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, hstack, vstack
from scipy.spatial.transform import Rotation

from estimator.fem.assembly.body import Response
from estimator.fem.terms.term import Term

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Rubbing:
    """What rubs at a state, and how that changes.

    Attributes
    ----------
    forces : (n, 3) as they join the internal ones, N
    blocks : (n, 3, 3) their symmetric derivative by the way of each node along its plate, N/m
    along : (3n, r) by each of r normal forces
    by_forces : (r, 3n) these normal forces by the forces on held degrees of freedom
    rides : (n,) bool, at which nodes the plate is the gripper's, moves with it and hands it the force
    """

    forces: FloatArray
    blocks: FloatArray
    along: csr_array
    by_forces: csr_array
    rides: BoolArray

    def beside(self, other: Rubbing) -> Rubbing:
        """Return both together: they act at different nodes."""
        return Rubbing(
            self.forces + other.forces,
            self.blocks + other.blocks,
            csr_array(hstack([self.along, other.along])),
            csr_array(vstack([self.by_forces, other.by_forces])),
            self.rides | other.rides,
        )

    def following(self, forces: FloatArray) -> FloatArray:
        """Return how the forces (3n, k) change as those (3n, k) on held degrees of freedom do, N."""
        return np.asarray(self.along @ (self.by_forces @ forces))

    def of_ways(self, ways: FloatArray) -> FloatArray:
        """Return how the forces (3n, k) change as the nodes go ways (3n, k) along their plates, m."""
        nodal = ways.reshape(len(self.blocks), 3, -1)
        return np.asarray(np.einsum("nij,njk->nik", self.blocks, nodal).reshape(ways.shape))

    def on_gripper(self, forces: FloatArray) -> FloatArray:
        """Return what of forces (3n, k) acts where the plate is the gripper's."""
        return np.where(np.repeat(self.rides, 3)[:, None], forces, 0.0)


@runtime_checkable
class Rubs(Protocol):
    """A term that rubs on what holds the tissue, beside what every term answers."""

    def carried_to(self, position: FloatArray, rotation: Rotation) -> Self:
        """Return the term with the gripper frame's origin at a position (3,), m, turned from rest by a rotation."""
        ...

    def rubbing(self, displacement: FloatArray, response: Response) -> Rubbing:
        """Return what it does at nodal displacements (n, 3), m."""
        ...


def carried_to(position: FloatArray, rotation: Rotation, terms: tuple[Term, ...]) -> tuple[Term, ...]:
    """Return terms with the gripper frame's origin at a position (3,), m, turned from rest by a rotation."""
    return tuple(term.carried_to(position, rotation) if isinstance(term, Rubs) else term for term in terms)


def that_rub(terms: tuple[Term, ...]) -> tuple[Term, ...]:
    """Return those terms that rub on what holds the tissue."""
    return tuple(term for term in terms if isinstance(term, Rubs))


def summed_rubbing(terms: tuple[Term, ...], displacement: FloatArray, response: Response) -> Rubbing | None:
    """Return what all terms that rub do at nodal displacements (n, 3), m; None where none does."""
    each = [term.rubbing(displacement, response) for term in terms if isinstance(term, Rubs)]
    return reduce(Rubbing.beside, each) if each else None
