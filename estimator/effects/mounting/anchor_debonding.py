"""Part of the anchored face is not attached, throughout or from an instant on."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimator.effects.blocks import Group
from estimator.effects.effect import Amplitude, Constant, Effect, Readings, Values
from estimator.effects.shared.instants import ORDER, in_order, start_of_row
from estimator.effects.shared.misfit import fiducial_misfit
from estimator.effects.stages import Hook, Stage
from estimator.experiment import Experiment
from estimator.fem.boundary.anchorage import anchored_areas, rim_of, set_free, springs_of_partly_attached
from estimator.fem.boundary.peeling import PeelingAnchor
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.terms.steady import NodalSprings
from estimator.fem.terms.term import Term
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

_SHARE = Amplitude("share", "1", scale=0.2, smallest=0.02, lower=0.0, upper=0.9)
_PLACE = Constant("place", "1", tuple(n / 8 for n in range(9)), 0.0, 1.0)
# A search looks over all stretches that end at two of so many even steps along the rim.
_STEPS_OF_RIM = 16
_BEGINS = Constant("begins", "1", (), 0.0, 1.0)
_LASTS = Constant("duration", "s", (5.0,), 0.1, 100.0)
# An anchor that comes off on its own is tried where two shares, one on either side of an instant, explain this share of
# what the beads leave beyond noise, more than one share does. Of glue that failed in the midst of a retraction they
# explained 0.67, of six other causes 0.28 at the most.
_DIVIDED = 0.4
_TRIED_PLACES = (0.0, 0.25, 0.5, 0.75, 1.0)


class AnchorDebonding(Effect):
    """A stretch along the anchored rim has come off.

    The amplitude is its share of the anchored area. Its place is 0 at one end of the anchored rim and 1 at the other
    (anticlockwise about z), 0.5 in the middle; where two sides are anchored the rim runs along both. A node whose
    tissue is attached in part is held by a spring, rigid once all of it is attached, none where none is: the answer
    is continuous in share and place.
    """

    label: ClassVar[str] = "anchor_debonding"
    group: ClassVar[Group] = "anchor"
    stage: ClassVar[Stage] = "mounting"
    acts_on: ClassVar[tuple[Hook, ...]] = ("problem", "terms")
    words: ClassVar[str] = "Part of the anchored face is not attached."
    keeps_pattern: ClassVar[bool] = False
    form = "throughout"
    amplitudes = (_SHARE,)
    constants: tuple[Constant, ...] = (_PLACE,)

    def place(self, problem: RetractionProblem, values: Values) -> tuple[FloatArray, float] | None:
        """Return the middle of the stretch and half its length."""
        rim = rim_of(problem)
        weight = rim.area * (1.0 - rim.attached(values["share"], values["place"]))
        if not weight.any():
            return None
        points = problem.body.mesh.points
        centre = np.average(points, axis=0, weights=weight)
        # A uniform stretch of length l has the variance l²/12 along itself.
        spread = np.average((points[:, :2] - centre[:2]) ** 2, axis=0, weights=weight).sum()
        return centre, float(np.sqrt(3.0 * spread))

    def looked_over(self, best: Values | None = None) -> list[dict[str, float]]:
        """Return the stretches between any two of some steps along the rim, on whichever anchors that lie there.

        About the best of them, those whose ends are less than a step from its own, in quarters of a step.
        """
        if best is None:
            ends = set(itertools.combinations(np.linspace(0.0, 1.0, _STEPS_OF_RIM + 1).tolist(), 2))
        else:
            first = best["place"] * (1.0 - best["share"])
            aside = np.linspace(-0.75, 0.75, 7) / _STEPS_OF_RIM
            around = itertools.product(first + aside, first + best["share"] + aside)
            ends = {(float(max(one, 0.0)), float(min(other, 1.0))) for one, other in around}
        return [
            _between(one, other)
            for one, other in sorted(ends)
            if _SHARE.smallest <= other - one <= _SHARE.upper
        ]

    def past_kinks(self, problem: RetractionProblem, values: Values) -> list[dict[str, float]]:
        """Return the stretch with either end one column of nodes further out or in.

        Where a column comes off altogether the derivatives jump, so that the misfit may have a minimum there.
        """
        rim = rim_of(problem)
        column = float(np.median(rim.end - rim.start))
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
            {**values, **_between(one, other)}
            for one, other in within
            if _SHARE.smallest <= other - one <= _SHARE.upper and (one, other) != (first, last)
        ]

    def problem(self, problem: RetractionProblem, values: Values) -> RetractionProblem:
        """Set the nodes of the stretch free."""
        if not values["share"]:
            return problem
        attachment = problem.attachment * rim_of(problem).attached(values["share"], values["place"])
        return set_free(problem, attachment < problem.attachment, attachment)

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Hold the nodes at the ends of the stretch by springs, unless the anchor's own do where all of it yields."""
        share = problem.attachment
        partly = (share > 0.0) & (share < 1.0)
        rigid = (problem.anchored & problem.fixed).any()
        if not (values["share"] and partly.any() and rigid):
            return ()
        area, _ = anchored_areas(problem)
        return (NodalSprings(springs_of_partly_attached(area, share, material.youngs_modulus)),)


class AnchorPeeling(AnchorDebonding):
    """The stretch comes off while an experiment runs, from its place outwards, evenly over some time; it stays off.

    It begins after a share of the experiment's time. By the next experiment all of it is off.
    """

    form = "from_an_instant"
    elaborates = "throughout"
    accident = True
    rate_dependent = True
    constants = (_PLACE, ORDER, _BEGINS, _LASTS)

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return some places, about the instant which best divides the beads' misfit; none where no instant does.

        Softer anchors let every bead move on by some share of how far it has moved: before that instant by another than
        after it.
        """
        ordered = in_order(baseline)
        misfit = np.concatenate([fiducial_misfit(each) for each in ordered])
        moved = np.concatenate([each.fiducials - each.rest_fiducials for each in ordered])
        along, square = np.cumsum(misfit * moved, axis=0), np.cumsum(moved**2, axis=0)
        tiny = np.finfo(float).tiny
        before = along**2 / np.maximum(square, tiny)
        after = (along[-1] - along) ** 2 / np.maximum(square[-1] - square, tiny)
        gain = (before + after - before[-1])[:-1].sum(axis=(1, 2))
        noise = misfit.size * ordered[0].experiment.sensor.fiducial_std ** 2
        if gain.max() < _DIVIDED * (np.sum(misfit**2) - noise):
            return []
        instant = start_of_row(ordered, int(np.argmax(gain)) + 1)
        time = next(each.experiment.time for each in ordered if each.experiment.order == instant["order"])
        begins = (instant["time"] - _LASTS.grid[0] / 2 - time[0]) / (time[-1] - time[0])
        when = {
            "order": instant["order"],
            "begins": float(np.clip(begins, 0.0, 1.0)),
            "duration": _LASTS.grid[0],
        }
        return [{"place": place, **when} for place in _TRIED_PLACES]

    def looked_over(self, best: Values | None = None) -> list[dict[str, float]]:
        """Return nothing: the beads tell the instant, about which a search begins."""
        return []

    def choices(self, experiments: Sequence[Experiment]) -> int:
        """Return the number of experiments."""
        return len(experiments)

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Hold the nodes of the stretch until they come off."""
        freed = problem.attachment < 1.0
        if not (values["share"] and freed.any()):
            return ()
        waits_s, modulus = _seconds_until(experiment, values), material.youngs_modulus
        return (
            PeelingAnchor(
                rim_of(problem), freed, modulus, values["share"], values["place"], waits_s, values["duration"]
            ),
        )


def _between(first: float, last: float) -> dict[str, float]:
    """Return share and place of the stretch between two places of the rim, less than all of it."""
    share = last - first
    return {"share": share, "place": first / (1.0 - share)}


def _seconds_until(experiment: Experiment, values: Values) -> float:
    """Return the time from an experiment's first row until it begins, s: infinite before that experiment, −∞ after."""
    if experiment.order == round(values["order"]):
        return float(values["begins"] * (experiment.time[-1] - experiment.time[0]))
    return np.inf if experiment.order < values["order"] else -np.inf


ANCHOR_DEBONDING = AnchorDebonding()
ANCHOR_PEELING = AnchorPeeling()
