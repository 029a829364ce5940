"""What is looked at where a label leads: its finer forms, others at its place or past kinks, what it stands in for."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from contextlib import suppress
from dataclasses import replace

from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.fitting.parallel import solved_by
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.search.candidate import Candidate
from estimator.diagnosis.search.context import Context
from estimator.diagnosis.search.screening import Trial
from estimator.effects.catalogue import Catalogue
from estimator.effects.effect import Constant, Effect, Values
from estimator.errors import SolverError

# From the baseline's E and ν to a leader's, tried one after the other.
_SHARES_OF_THE_WAY = (1.0, 0.5, 0.25)


def elaborations(catalogue: Catalogue, labels: Collection[str]) -> list[Effect]:
    """Return the finer forms of labels, which are looked at only where these lead."""
    return [effect for effect in catalogue.effects if effect.elaborates and effect.label in labels]


def accidents(catalogue: Catalogue) -> list[Effect]:
    """Return the finer forms of what happens at one instant."""
    return [effect for effect in catalogue.effects if effect.elaborates and effect.accident]


def mistaken_for(context: Context, candidates: Sequence[Candidate]) -> list[Effect]:
    """Return what has no label and may be mistaken for a leader, which would leave no misfit to tell."""
    hypotheses = [one.fit.hypothesis for one in candidates]
    causes = [cause for one in hypotheses for cause in zip(one.effects, one.values, strict=True)]
    found = []
    for effect in context.catalogue.outsiders:
        for cause, values in causes:
            if cause.label in effect.mistaken_for:
                place = cause.place(context.case.problem, values)
                found.append(effect if place is None else effect.looked_for_at(*place))
                break
    return found


def with_material_of(context: Context, leader: Candidate) -> Linearisation:
    """Return the baseline with E and ν of a leader, where a form much like it is nearer to linear.

    A stress that relaxes by half leaves half of E: from the fitted E, the shares of two terms begin far off. Where the
    tissue has no equilibrium with these alone, they are as near to them as it has.
    """
    plain, found = replace(leader.fit.hypothesis, effects=(), values=()), context.baseline
    for share in _SHARES_OF_THE_WAY:
        with suppress(SolverError):
            nearer = plain.with_material_between(context.baseline.hypothesis, share)
            found = solved_by(context.executor)(context.case, nearer, context.baseline)
            break
    return found


def siblings(
    trials: Sequence[Trial], leading: Sequence[Candidate], candidates: Sequence[Candidate]
) -> list[Trial]:
    """Return the trials of the leaders' labels whose forms have not been refitted."""
    done = {one.fit.hypothesis.effects[0].name for one in candidates}
    labels = {one.labels[0] for one in leading}
    return [
        trial
        for trial in trials
        if trial.signature.effect.label in labels and trial.signature.effect.name not in done
    ]


def at_the_place_of(context: Context, leader: Candidate, candidates: Sequence[Candidate]) -> list[Hypothesis]:
    """Return the other forms of a leader's label with its values, where no refit of theirs has come there.

    A search from a grid may stop far from the place that another form has found. A constant that a form has beside what
    the leader has begins at either end of its grid, an amplitude at its null. A form of several terms that are alike is
    left out: none of them is where a single one fits best. Refinements of the leader's own form come first. Two places
    are the same where no constant differs by more than a share of its range.
    """
    hypothesis = leader.fit.hypothesis
    effect, values = hypothesis.effects[0], hypothesis.values[0]
    found = []
    same_place = context.settings.search.same_place
    for other in context.catalogue.effects:
        shared = [constant for constant in other.constants if constant.name in values and not constant.fixed]
        alike = other.label == effect.label and _has_what(effect, other) and shared
        if other.name == effect.name or not alike or _visited(other, shared, values, candidates, same_place):
            continue
        names = {a.name for a in other.amplitudes} | {c.name for c in other.constants}
        kept = {name: value for name, value in values.items() if name in names}
        null = {amplitude.name: 0.0 for amplitude in other.amplitudes}
        new = [constant for constant in other.constants if constant.name not in kept]
        if not all(constant.grid for constant in new) or (new and other.terms_alike):
            continue  # the measurements tell where such a one begins, in starts of its own
        for end in (0, -1):
            begun = {**null, **kept, **{constant.name: constant.grid[end] for constant in new}}
            start = replace(hypothesis, effects=(other,), values=(begun,))
            if start not in found:
                found.append(start)
    return sorted(found, key=lambda start: start.effects[0].elaborates != effect.form)


def past_kinks(case: Case, candidate: Candidate) -> list[Hypothesis]:
    """Return where a candidate's refit may begin anew, should it have stopped at a kink."""
    hypothesis = candidate.fit.hypothesis
    effect, values = hypothesis.effects[0], hypothesis.values[0]
    return [replace(hypothesis, values=(other,)) for other in effect.past_kinks(case.problem, values)]


def _has_what(effect: Effect, other: Effect) -> bool:
    """Tell whether another form has the amplitudes of an effect, and perhaps some more."""
    some_more = {one.name for one in effect.amplitudes} < {one.name for one in other.amplitudes}
    as_many = len(other.amplitudes) == len(effect.amplitudes)
    return other.amplitudes == effect.amplitudes if as_many else some_more


def _visited(
    form: Effect,
    shared: Iterable[Constant],
    values: Values,
    candidates: Sequence[Candidate],
    same_place: float,
) -> bool:
    """Tell whether a refit of a form has come where its constants have these values."""
    fits = [one.fit.hypothesis for one in candidates]
    reached = [fit.values[0] for fit in fits if fit.effects[0].name == form.name]
    return any(
        all(abs(there[c.name] - values[c.name]) < same_place * (c.upper - c.lower) for c in shared)
        for there in reached
    )
