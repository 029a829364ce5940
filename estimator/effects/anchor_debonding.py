"""Part of the anchored face is not attached."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import Amplitude, Constant, Effect, Group, Values
from estimator.experiment import Experiment
from estimator.fem.anchorage import anchored_areas, columns_of_rim, set_free
from estimator.fem.problem import RetractionProblem
from estimator.fem.steady import NodalSprings
from estimator.fem.terms import Term
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

_SHARE = Amplitude("share", "1", scale=0.2, smallest=0.02, lower=0.0, upper=0.9)
_PLACE = Constant("place", "1", tuple(n / 8 for n in range(9)), 0.0, 1.0)
# Stiffness of a node that is attached by half, over modulus times the root of its area: with it the gripping force
# falls evenly as more and more comes off, on coarse and fine meshes.
_HALF_ATTACHED = 0.3


class AnchorDebonding(Effect):
    """A stretch along the anchored rim has come off.

    The amplitude is its share of the anchored area. Its place is 0 at one end of the anchored rim and 1 at the other
    (anticlockwise about z), 0.5 in the middle; where two sides are anchored the rim runs along both. A node whose
    tissue is attached in part is held by a spring, rigid once all of it is attached, none where none is: the answer
    is continuous in share and place.
    """

    label: ClassVar[str] = "anchor_debonding"
    group: ClassVar[Group] = "anchor"
    words: ClassVar[str] = "Part of the anchored face is not attached."
    keeps_pattern: ClassVar[bool] = False
    amplitudes = (_SHARE,)
    constants = (_PLACE,)

    def place(self, problem: RetractionProblem, values: Values) -> tuple[FloatArray, float] | None:
        """Return the middle of the stretch and half its length."""
        area, _ = anchored_areas(problem)
        weight = area * (1.0 - attached(problem, values["share"], values["place"]))
        if not weight.any():
            return None
        points = problem.body.mesh.points
        centre = np.average(points, axis=0, weights=weight)
        # A uniform stretch of length l has the variance l²/12 along itself.
        spread = np.average((points[:, :2] - centre[:2]) ** 2, axis=0, weights=weight).sum()
        return centre, float(np.sqrt(3.0 * spread))

    def past_kinks(self, problem: RetractionProblem, values: Values) -> list[dict[str, float]]:
        """Return the stretch with either end one column of nodes further out or in.

        Where a column comes off altogether the derivatives jump, so that the misfit may have a minimum there.
        """
        _, begin, end = columns_of_rim(problem)
        column = float(np.median(end - begin))
        first = values["place"] * (1.0 - values["share"])
        last = first + values["share"]
        ends = [
            (first - column, last),
            (first + column, last),
            (first, last - column),
            (first, last + column),
        ]
        within = [(max(one, 0.0), min(other, 1.0)) for one, other in ends]
        return [
            {**values, "share": other - one, "place": one / (1.0 - (other - one))}
            for one, other in within
            if _SHARE.smallest <= other - one <= _SHARE.upper and (one, other) != (first, last)
        ]

    def problem(self, problem: RetractionProblem, values: Values) -> RetractionProblem:
        """Set the nodes of the stretch free."""
        if not values["share"]:
            return problem
        attachment = problem.attachment * attached(problem, values["share"], values["place"])
        return set_free(problem, attachment < problem.attachment, attachment)

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Hold the nodes at the ends of the stretch by springs."""
        share = problem.attachment
        partly = (share > 0.0) & (share < 1.0)
        if not (values["share"] and partly.any()):
            return ()
        area, _ = anchored_areas(problem)
        stiffness = np.zeros(len(share))
        stiffness[partly] = _HALF_ATTACHED * material.youngs_modulus * np.sqrt(area[partly])
        stiffness[partly] *= share[partly] / (1.0 - share[partly])
        return (NodalSprings(stiffness[:, None, None] * np.eye(3)),)


def attached(problem: RetractionProblem, share: float, place: float) -> FloatArray:
    """Return how much (n,) of each node's anchored area stays attached once a share of the rim has come off."""
    attached: FloatArray = np.ones(len(problem.attachment))
    nodes = np.flatnonzero(problem.anchored)
    column, start, end = columns_of_rim(problem)
    first = place * (1.0 - share)
    lost = np.clip(np.minimum(end, first + share) - np.maximum(start, first), 0.0, None)
    middle = (start + end) / 2
    inside = (middle > first) & (middle < first + share)
    width = end - start
    lost = np.where(width > 1e-9, lost / np.maximum(width, 1e-9), inside)
    attached[nodes] = np.where(lost[column] < 1e-9, 1.0, np.clip(1.0 - lost[column], 0.0, 1.0))
    return attached


ANCHOR_DEBONDING = AnchorDebonding()
