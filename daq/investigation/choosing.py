"""Which manoeuvre comes next: the one that is expected to tell most in a minute, of those that are safe."""

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

from daq.investigation.journal import Journal
from daq.investigation.laboratory import Laboratory
from daq.investigation.manoeuvre import Manoeuvre
from daq.investigation.safety import (
    Bounds,
    damage,
    forbidden_by_load,
    forbidden_by_reach,
    forbidden_unmeasured,
    stretch_of,
)
from estimator.optimal_design.beliefs import Belief, beliefs_of
from estimator.optimal_design.examination import Examination
from estimator.optimal_design.foreseeing import foresee, foresee_unstrained
from estimator.optimal_design.information import Predictive, best_parted, expected_information

_MINUTE_S = 60.0
_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class Proposal:
    """A manoeuvre that is safe as far as can be foreseen, and why it is proposed.

    Attributes
    ----------
    manoeuvre : Manoeuvre
    nats : information that it is expected to give about which answer is right
    reason : for a person
    damages : what it could damage; empty for nothing
    """

    manoeuvre: Manoeuvre
    nats: float
    reason: str
    damages: str

    @property
    def nats_per_minute(self) -> float:
        """Of rig and person."""
        return self.nats * _MINUTE_S / self.manoeuvre.duration_s


def openings(
    laboratory: Laboratory, offered: Sequence[Manoeuvre], journal: Journal, bounds: Bounds
) -> list[Proposal]:
    """Return those of the manoeuvres offered that are safe before anything was measured, in their order."""
    rig = laboratory.rig
    reason = (
        f"a short pull that is safe while nothing is known: tissue of {bounds.stiffest_pa / 1e3:g} kPa would stay "
        "within the limits"
    )
    return [
        Proposal(one, 0.0, reason, damage(one, rig, 0.0))
        for one in offered
        if journal.is_open(one)
        and not forbidden_by_reach(one, rig, bounds)
        and not forbidden_unmeasured(one, rig, bounds)
    ]


def candidates(
    laboratory: Laboratory,
    offered: Sequence[Manoeuvre],
    journal: Journal,
    bounds: Bounds,
    seconds_left: float,
) -> list[Manoeuvre]:
    """Return what could be done next: still open, within reach, in the time that is left."""
    done = (stretch_of(one.manoeuvre, laboratory.rig) for one in journal.entries)
    farthest = bounds.growth * max(done, default=bounds.stretch)
    return [
        one
        for one in offered
        if one.kind in laboratory.kinds
        and journal.is_open(one)
        and one.duration_s <= seconds_left
        and stretch_of(one, laboratory.rig) <= farthest + _ROUNDING
        and not forbidden_by_reach(one, laboratory.rig, bounds)
    ]


def ranked(
    laboratory: Laboratory,
    examination: Examination,
    chosen_from: Sequence[Manoeuvre],
    journal: Journal,
    bounds: Bounds,
    executor: Executor,
) -> list[Proposal]:
    """Return the proposals that are safe by what is foreseen of them, the one that tells most in a minute first."""
    context = examination.comparison.context
    beliefs = beliefs_of(examination.comparison, examination.probability)
    rows = {one: laboratory.planned(one, context.case.experiments[-1]) for one in chosen_from}
    jobs = {
        one: executor.submit(foresee, context.case, context.baseline.hypothesis, beliefs, rows[one])
        for one in chosen_from
        if one.strains
    }
    farthest = max((stretch_of(one.manoeuvre, laboratory.rig) for one in journal.entries), default=0.0)
    found = []
    for done, one in enumerate(chosen_from, start=1):
        if one.strains:
            foresight = jobs[one].result()
            if foresight is None or forbidden_by_load(foresight, laboratory.rig, bounds):
                continue
            foreseen = foresight.by_answer
        else:
            foreseen = foresee_unstrained(examination.comparison, beliefs, rows[one])
        context.tell("weighing what could be done next", done, len(chosen_from))
        found.append(_proposal(one, beliefs, foreseen, damage(one, laboratory.rig, farthest)))
    return sorted(found, key=lambda proposal: -proposal.nats_per_minute)


def _proposal(
    manoeuvre: Manoeuvre, beliefs: Sequence[Belief], foreseen: Sequence[Predictive], damages: str
) -> Proposal:
    probability = [one.probability for one in beliefs]
    expected = expected_information(probability, foreseen)
    one, other = (beliefs[number].label for number in best_parted(probability, foreseen))
    nats = max(expected.nats, 0.0)
    minutes = manoeuvre.duration_s / _MINUTE_S
    reason = f"expected to tell {nats:.2f} nat in {minutes:.1f} min; parts {one} and {other} best"
    return Proposal(manoeuvre, nats, reason, damages)
