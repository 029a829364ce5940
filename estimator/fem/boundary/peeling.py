"""An anchor that comes off while an experiment runs: springs that hold its nodes until then."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimator.fem.assembly.body import Response
from estimator.fem.boundary.anchorage import Rim, springs_of_partly_attached
from estimator.fem.terms.steady import NodalSprings
from estimator.fem.terms.term import Memoryless, TermStiffness

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

# A node that is attached by all but this is held as rigidly as one that stands still, to the last digit that matters.
_ALL_BUT = 1e-4


@dataclass(frozen=True, eq=False)
class PeelingAnchor(Memoryless):
    """A stretch of the anchored rim that comes off from one place, evenly over some time.

    Attributes
    ----------
    rim : of the anchors
    freed : (n,) bool, nodes of the whole stretch, which the problem leaves free
    modulus : of the tissue, Pa
    share, place : what is off in the end, as in :meth:`estimator.fem.boundary.anchorage.Rim.attached`
    waits_s : until it begins to come off; negative where it has begun, infinite where it does not in this experiment
    lasts_s : until all of it is off
    """

    timed: ClassVar[bool] = True

    rim: Rim
    freed: BoolArray
    modulus: float
    share: float
    place: float
    waits_s: float
    lasts_s: float

    def forces(self, displacement: FloatArray, response: Response) -> FloatArray:
        """Return the forces (n, 3), N, with which the springs are stretched."""
        return self._holding.forces(displacement, response)

    def stiffness(self, displacement: FloatArray, response: Response) -> TermStiffness:
        """Return the springs' stiffness."""
        return self._holding.stiffness(displacement, response)

    def starting_after(self, seconds: float) -> PeelingAnchor:
        """Return the term with less time to wait; itself where it stays as it is."""
        settled = not np.isfinite(self.waits_s) or -self.waits_s >= self.lasts_s
        return self if settled else replace(self, waits_s=self.waits_s - seconds)

    @cached_property
    def _holding(self) -> NodalSprings:
        """What holds the stretch at this time."""
        done = float(np.clip(-self.waits_s / self.lasts_s, 0.0, 1.0))
        held = np.minimum(self.rim.attached(done * self.share, self.place), 1.0 - _ALL_BUT)
        share = np.where(self.freed, held, 1.0)
        return NodalSprings(springs_of_partly_attached(self.rim.area, share, self.modulus))
