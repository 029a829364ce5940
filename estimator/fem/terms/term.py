"""Forces on the tissue besides its own stress: springs, weight, friction, fibres, stresses that remember.

A term adds nodal forces to the equilibrium and, where it is stiff, its tangent. One that remembers (friction, a
relaxing stress) is advanced from one solved state to the next; it is a value: advancing returns another term.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from operator import add
from typing import ClassVar, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from estimator.fem.assembly.body import AddedEnergy, Response

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class TermStiffness:
    """Derivative of a term's nodal forces by the displacements, as far as the solver is to know it.

    Attributes
    ----------
    nodes : (n, 3, 3) symmetric blocks of single nodes, N/m; None where there are none
    elements : (e, 3k, 3k) added to the elements' stiffness, lower triangle; None where there is none
    energy : added to the tissue's own, whose tangent has the stiffness of both; None where there is none
    """

    nodes: FloatArray | None = None
    elements: FloatArray | None = None
    energy: AddedEnergy | None = None


class Memoryless:
    """What a term that remembers nothing answers to the passing of time: itself.

    One that is timed becomes another at some instant, whatever went before.
    """

    timed: ClassVar[bool] = False

    def starting_after(self, seconds: float) -> Self:
        """Return the term itself."""
        return self

    def after(self, displacement: FloatArray, response: Response) -> Self:
        """Return the term itself."""
        return self

    def rested(self) -> Self:
        """Return the term itself."""
        return self


class BeginsAnew:
    """Marks a term that remembers within an experiment alone: rested, it is as it was when the first one began."""


class Term(Protocol):
    """A force on the tissue besides its own stress."""

    def forces(self, displacement: FloatArray, response: Response) -> FloatArray:
        """Return the nodal forces (n, 3), N, that join the internal ones: a load enters with a minus sign."""
        ...

    def stiffness(self, displacement: FloatArray, response: Response) -> TermStiffness:
        """Return the derivative of :meth:`forces`."""
        ...

    def starting_after(self, seconds: float) -> Term:
        """Return the term for a state that follows the last one after some time."""
        ...

    def after(self, displacement: FloatArray, response: Response) -> Term:
        """Return the term once a state has been reached."""
        ...

    def rested(self) -> Term:
        """Return the term at the start of the next experiment, the tissue back at rest for long."""
        ...


def summed_stiffness(terms: tuple[Term, ...], displacement: FloatArray, response: Response) -> TermStiffness:
    """Return the stiffness of all terms together at nodal displacements (n, 3), m."""
    each = [term.stiffness(displacement, response) for term in terms]
    nodes = [one.nodes for one in each if one.nodes is not None]
    elements = [one.elements for one in each if one.elements is not None]
    energies = [one.energy for one in each if one.energy is not None]
    return TermStiffness(
        sum(nodes[1:], nodes[0]) if nodes else None,
        sum(elements[1:], elements[0]) if elements else None,
        reduce(add, energies) if energies else None,
    )
