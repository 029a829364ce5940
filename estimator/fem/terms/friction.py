"""Lying on a flat table: contact that carries the weight and lets the tissue lift off, and dry friction on it.

Each node sticks to a point of the table by a spring that yields at the friction limit and then drags that point along
(`estimator/fem/terms/return_mapping.py`). The limit follows the contact pressure of the last solved state, which keeps
the tangent symmetric. So does what the limit is raised by where a node has hardly slid yet: static friction, which
sliding over the length at which it began wears down to that of sliding (J. H. Dieterich, J. Geophys. Res. 84 (1979)
2161, without its healing).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.fem.assembly.body import Response
from estimator.fem.terms.return_mapping import Stretched, stretched
from estimator.fem.terms.term import BeginsAnew, TermStiffness

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LyingOnTable:
    """A table below the tissue, which at rest carries its weight.

    Only what departs from that rest acts: as a node rises by the depth to which it sank at rest, the table's push falls
    to nothing, and its weight alone is left to draw it down; as it sinks further the push grows at the same rate.

    Attributes
    ----------
    weight : (n,) ≥ 0, that each node rests on the table with, N; zero off the table
    adhesion : (n,) ≥ 0, normal force that stickiness adds for the friction, N
    coefficient : of friction
    elastic_slip_m : displacement at which a node that stuck starts to slide
    depth_m : to which a node sinks under its weight; infinite where the table does but rub
    pressing : (n,) ≥ 0, normal force in the last solved state, N
    slid : (n, 2) how far each node's sticking point has moved, m
    breakaway : share by which the limit is raised before anything has slid
    travelled : (n,) way that each node has slid, m
    """

    weight: FloatArray
    adhesion: FloatArray
    coefficient: float
    elastic_slip_m: float
    depth_m: float
    pressing: FloatArray
    slid: FloatArray
    breakaway: float
    travelled: FloatArray

    @classmethod
    def at_rest(
        cls,
        weight: FloatArray,
        adhesion: FloatArray,
        coefficient: float,
        elastic_slip_m: float,
        depth_m: float,
        breakaway: float = 0.0,
    ) -> LyingOnTable:
        """Return the contact of a body that has not moved yet."""
        nowhere = np.zeros((len(weight), 2))
        return cls(
            weight,
            adhesion,
            coefficient,
            elastic_slip_m,
            depth_m,
            weight,
            nowhere,
            breakaway,
            np.zeros(len(weight)),
        )

    def forces(self, displacement: FloatArray, response: Response) -> FloatArray:
        """Return the forces (n, 3), N, that the tissue's motion has to overcome."""
        on = self._stretched(displacement)
        normal = self.weight - self._normal(displacement)
        return np.column_stack([(self._spring * on.share)[:, None] * on.stretch, normal])

    def stiffness(self, displacement: FloatArray, response: Response) -> TermStiffness:
        """Return the derivative: that of the springs, or across the direction of sliding."""
        on = self._stretched(displacement)
        blocks: FloatArray = np.zeros((len(displacement), 3, 3))
        blocks[:, :2, :2] = np.eye(2)
        blocks[on.sliding, :2, :2] -= on.direction[:, :, None] * on.direction[:, None, :]
        blocks *= (self._spring * on.share)[:, None, None]
        touching = displacement[:, 2] < self.depth_m
        blocks[:, 2, 2] = np.where(touching, self.weight / self.depth_m, 0.0)
        return TermStiffness(nodes=blocks)

    def starting_after(self, seconds: float) -> LyingOnTable:
        """Return the same contact: it knows no rate."""
        return self

    def after(self, displacement: FloatArray, response: Response) -> LyingOnTable:
        """Return the contact with the sticking points dragged along, and the pressure of this state."""
        slip = self._stretched(displacement).slip
        return replace(
            self,
            slid=self.slid + slip,
            travelled=self.travelled + np.linalg.norm(slip, axis=1),
            pressing=self._normal(displacement),
        )

    def rested(self) -> LyingOnTable:
        """Return the same contact: what has slid stays where it is."""
        return self

    @property
    def _spring(self) -> FloatArray:
        """Stiffness (n,) of what sticks, N/m."""
        raised = 1.0 + self.breakaway * np.exp(-self.travelled / self.elastic_slip_m)
        return np.asarray(raised * self.coefficient * (self.pressing + self.adhesion) / self.elastic_slip_m)

    def _normal(self, displacement: FloatArray) -> FloatArray:
        """Return the normal force (n,) of the table, N."""
        return self.weight * (1.0 - np.minimum(displacement[:, 2] / self.depth_m, 1.0))

    def _stretched(self, displacement: FloatArray) -> Stretched:
        return stretched(displacement[:, :2], self.slid, self.elastic_slip_m)


class LaidDownAnew(LyingOnTable, BeginsAnew):
    """The same contact of a phantom that is lifted and laid down before each experiment."""

    def rested(self) -> LyingOnTable:
        """Return the contact free of stress."""
        return replace(
            self,
            slid=np.zeros_like(self.slid),
            travelled=np.zeros_like(self.travelled),
            pressing=self.weight,
        )
