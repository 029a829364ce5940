"""Dry friction on flat plates between which tissue is pressed: Coulomb's law, with the pressure of the same state.

Each node sticks to a point of its plate by a spring, which yields where friction bears no more: the coefficient times
the force with which the plate presses there. That is the plate's own reaction, so that what rubs follows it at once
(Wriggers, Computational Contact Mechanics, 2006, section 10.5.2); the points stick to the gripper's plate where it is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial.transform import Rotation

from estimator.fem.assembly.body import Body, Response, nodal_forces
from estimator.fem.boundary.platens import Platens
from estimator.fem.terms.return_mapping import Stretched, stretched
from estimator.fem.terms.rubbing import Rubbing
from estimator.fem.terms.term import BeginsAnew, TermStiffness

FloatArray = NDArray[np.float64]

# What slides is still held by this share of the spring: a body between two smooth plates is not adrift.
_LEFT = 1e-4


@dataclass(frozen=True, eq=False)
class RubbingOnPlatens(BeginsAnew):
    """Plates on which tissue rubs.

    Attributes
    ----------
    body : of the tissue, whose own stress presses on the plates
    platens : the plates
    spring : (n,) stiffness with which each node sticks, N/m; zero where it does not rub
    coefficient : of friction
    slid : (n, 2) how far each node's sticking point has moved on its plate, m
    carried : (n, 3) how far the gripper's plate carries what sticks to it, m
    """

    body: Body
    platens: Platens
    spring: FloatArray
    coefficient: float
    slid: FloatArray
    carried: FloatArray

    @classmethod
    def at_rest(
        cls, body: Body, platens: Platens, spring: FloatArray, coefficient: float
    ) -> RubbingOnPlatens:
        """Return the plates on tissue that has not moved yet."""
        nowhere = np.zeros((len(spring), 3))
        return cls(body, platens, spring, coefficient, nowhere[:, :2], nowhere)

    def carried_to(self, position: FloatArray, rotation: Rotation) -> RubbingOnPlatens:
        """Return the plates with the gripper frame's origin at a position (3,), m, turned from rest by a rotation."""
        return replace(self, carried=self.platens.carried(position, rotation))

    def forces(self, displacement: FloatArray, response: Response) -> FloatArray:
        """Return the forces (n, 3), N, with which the springs are stretched."""
        _, on = self._stretched(displacement, response)
        return self._forces(on)

    def stiffness(self, displacement: FloatArray, response: Response) -> TermStiffness:
        """Return the derivative at constant pressure."""
        return TermStiffness(nodes=self.rubbing(displacement, response).blocks)

    def rubbing(self, displacement: FloatArray, response: Response) -> Rubbing:
        """Return the forces and their derivatives."""
        pressed, on = self._stretched(displacement, response)
        count, sliding = len(displacement), np.flatnonzero(on.sliding)
        across = np.eye(2) - on.direction[:, :, None] * on.direction[:, None, :]
        stiffness: FloatArray = np.tile(np.eye(2), (count, 1, 1))
        stiffness[sliding] = (1.0 - _LEFT) * on.share[sliding, None, None] * across + _LEFT * np.eye(2)
        blocks: FloatArray = np.zeros((count, 3, 3))
        along = np.array(self._along)
        blocks[:, along[:, None], along] = self.spring[:, None, None] * stiffness
        follows = pressed[sliding] > 0.0
        chosen = sliding[follows]
        by_pressing = (1.0 - _LEFT) * self.coefficient * on.direction[follows]
        rows, columns = (3 * chosen[:, None] + along).ravel(), np.repeat(np.arange(len(chosen)), 2)
        return Rubbing(
            self._forces(on),
            blocks,
            csr_array((by_pressing.ravel(), (rows, columns)), shape=(3 * count, len(chosen))),
            self.platens.pressing[chosen],
            self.platens.moving,
        )

    def starting_after(self, seconds: float) -> RubbingOnPlatens:
        """Return the same plates: they know no rate."""
        return self

    def after(self, displacement: FloatArray, response: Response) -> RubbingOnPlatens:
        """Return the plates with the sticking points dragged along."""
        _, on = self._stretched(displacement, response)
        return replace(self, slid=self.slid + on.slip)

    def rested(self) -> RubbingOnPlatens:
        """Return the plates on tissue that was put between them anew."""
        return replace(self, slid=np.zeros_like(self.slid), carried=np.zeros_like(self.carried))

    @property
    def _along(self) -> list[int]:
        return [axis for axis in range(3) if axis != self.platens.axis]

    def _forces(self, on: Stretched) -> FloatArray:
        """Return the forces (n, 3) of springs that are stretched so, N, with what is left once they have yielded."""
        kept = on.share + _LEFT * (1.0 - on.share)
        forces = np.zeros((len(kept), 3))
        forces[:, self._along] = (self.spring * kept)[:, None] * on.stretch
        return forces

    def _stretched(self, displacement: FloatArray, response: Response) -> tuple[FloatArray, Stretched]:
        """Return what presses at each node (n,), N, and how its spring is stretched."""
        held = nodal_forces(self.body, response, response.slope)
        pressed = np.maximum(self.platens.pressing @ held.ravel(), 0.0)
        reach = np.full(len(pressed), np.inf)
        np.divide(self.coefficient * pressed, self.spring, out=reach, where=self.spring > 0.0)
        way = displacement - self.carried
        return pressed, stretched(way[:, self._along], self.slid, reach)
