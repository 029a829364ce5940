"""The search for two causes: pairs are refitted, in finer forms where they leave something or rival each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.search.candidate import Candidate, best_of_labels, most_probable_first
from estimator.diagnosis.search.comparison import Comparison
from estimator.diagnosis.search.context import Context
from estimator.diagnosis.search.pair_screening import likeliest_pairs
from estimator.diagnosis.search.racing import is_linear, race
from estimator.diagnosis.search.refinements import elaborations, mistaken_for
from estimator.diagnosis.search.screening import best_starts, screen
from estimator.diagnosis.search.second_cause import promising_seconds, starts_of_pairs
from estimator.effects.effect import Effect, Values


@dataclass(frozen=True)
class Found:
    """What a search for two causes has found.

    Attributes
    ----------
    alone : the best single cause: the one known before, or one that a pair has led to a better place
    pairs : refitted, the most probable first
    """

    alone: Candidate
    pairs: tuple[Candidate, ...]


def search_pairs(comparison: Comparison, best: Candidate) -> Found:
    """Look for a second cause beside the leaders of a comparison, of which ``best`` is what a pair has to beat."""
    settings = comparison.settings
    leaders = best_of_labels(comparison.candidates)[: settings.leaders]
    pairs = _refitted(comparison, leaders, best)
    found = _led_on(comparison, best, pairs)
    alone = most_probable_first([best, *found])[0]
    if alone is not best:
        pairs = _refitted(comparison, best_of_labels([alone, *leaders])[: settings.leaders], alone)
    # Where the best pair adds little, or falls short of the unknown, other forms of its causes will not do either.
    least = alone.log_evidence + settings.adds_little
    if pairs and pairs[0].log_evidence > least:
        ties = beside_what_ties(comparison, pairs)
        pairs = _with_more(comparison.context, pairs, ties, pairs[0].log_evidence)
        promised = alone.log_evidence + settings.passed_over * (pairs[0].log_evidence - alone.log_evidence)
        passed = passed_over(comparison, pairs, promised)
        pairs = _with_more(comparison.context, pairs, passed, promised)
    if pairs and pairs[0].log_evidence > max(comparison.unknown, least):
        finer = _finer_forms(comparison, pairs)
        pairs = _with_more(comparison.context, pairs, finer, pairs[0].log_evidence)
        refitted = replace(
            comparison, candidates=tuple(most_probable_first([*comparison.candidates, *found]))
        )
        alone = most_probable_first([alone, *_led_on(refitted, alone, pairs)])[0]
    return Found(alone, tuple(pairs))


def _with_more(
    context: Context, pairs: list[Candidate], starts: Sequence[Hypothesis], bar: float
) -> list[Candidate]:
    """Return the pairs, and those that a race from more starts over a bar has found, the most probable first."""
    return most_probable_first([*pairs, *race(context, starts, bar)]) if starts else pairs


def _refitted(comparison: Comparison, leaders: Sequence[Candidate], best: Candidate) -> list[Candidate]:
    table = comparison.table
    begun = starts_of_pairs(table, leaders, comparison.trials)
    bar = best.log_evidence + table.asked_of_two(best, best.labels)
    return race(comparison.context, begun, bar) if begun else []


def beside_what_ties(comparison: Comparison, pairs: Sequence[Candidate]) -> list[Hypothesis]:
    """Return starts of the best pair's second cause beside what ties with its first, where that pair leaves something.

    Causes that take one another's place alone may do so no longer where the second one is beside them.

    Parameters
    ----------
    pairs : refitted, one at least, the most probable first; what is among them is not begun again
    """
    leaves_something = not comparison.table.is_whole(pairs[0])
    settings = comparison.settings
    best, *others = best_of_labels(comparison.candidates)
    least = best.log_evidence - settings.alike * (best.log_evidence - comparison.none)
    alike = [one for one in others if one.log_evidence > least]
    tried = {frozenset(pair.labels) for pair in pairs}
    both = pairs[0].fit.hypothesis
    return [
        one.fit.hypothesis.with_effect(effect, values)
        for effect, values in zip(both.effects, both.values, strict=True)
        if effect.label not in {one.labels[0] for one in (best, *alike)}
        for one in alike
        if leaves_something and frozenset((*one.labels, effect.label)) not in tried
    ][: settings.more]


def passed_over(comparison: Comparison, pairs: Sequence[Candidate], least: float) -> list[Hypothesis]:
    """Return starts of second causes beside the best pair's first one that promised less than its second.

    First order promises too little of what is far from linear, as of fibres that bear in tension alone; of what is
    linear it promises what a refit keeps.

    Parameters
    ----------
    pairs : refitted, one at least, the most probable first; what is among them is not begun again
    least : log evidence that they promise at least
    """
    firsts = [one for one in comparison.candidates if one.labels[0] in pairs[0].labels][:1]
    tried = {frozenset(pair.labels) for pair in pairs}
    return [
        start.hypothesis
        for first in firsts
        for start in promising_seconds(comparison.table, first, comparison.trials)
        if start.labels not in tried
        and start.log_evidence > least
        and not is_linear(start.hypothesis.effects[-1])
    ][: comparison.settings.more]


def with_what_it_is_mistaken_for(comparison: Comparison, pair: Candidate) -> Comparison:
    """Return the comparison with what has no label refitted too, where it may pass for either cause of a pair."""
    context, settings = comparison.context, comparison.settings
    tried = {one.fit.hypothesis.effects[0].name for one in comparison.candidates}
    effects = [one for one in mistaken_for(context, [pair]) if one.name not in tried]
    if not effects:
        return comparison
    trials = screen(context, effects)
    starts = [trial.start for trial in best_starts(trials, settings.starts)[: settings.finer]]
    # They begin where a pair has its best place, as beside a single cause, and fall short of it by more at first.
    bar = pair.log_evidence - settings.alike * (pair.log_evidence - comparison.none)
    found = race(context, starts, bar)
    candidates = most_probable_first([*comparison.candidates, *found])
    return replace(comparison, trials=(*comparison.trials, *trials), candidates=tuple(candidates))


def _led_on(comparison: Comparison, best: Candidate, pairs: Sequence[Candidate]) -> list[Candidate]:
    """Return single causes refitted from where the best pair has led them, if that explains more than the best alone.

    What another form or another place of one cause explains is no evidence of a second one. A refit of one cause alone
    may stop where one with a second effect goes on: at a kink, where tissue comes off node by node, or far from a large
    pretension, which changes the tissue's shape.
    """
    starts = [
        start
        for pair in pairs[:1]
        if pair.log_evidence > best.log_evidence
        for start in led_on_by(pair.fit.hypothesis, comparison.candidates, comparison.settings.near)
    ]
    return race(comparison.context, starts, best.log_evidence)


def led_on_by(pair: Hypothesis, candidates: Sequence[Candidate], near: float) -> list[Hypothesis]:
    """Return each cause of a pair alone, with its values there, where no refit of its form alone has come near them.

    Sizes of an effect that differ by no more than the share ``near``, and places within it of their range, are one.
    """
    singles = [one.fit.hypothesis for one in candidates if len(one.labels) == 1]
    return [
        replace(pair, effects=(effect,), values=(values,))
        for effect, values in zip(pair.effects, pair.values, strict=True)
        if not any(
            one.effects[0].name == effect.name and _is_near(effect, one.values[0], values, near)
            for one in singles
        )
    ]


def _is_near(effect: Effect, one: Values, other: Values, near: float) -> bool:
    """Tell whether an effect is nearly as large, and in nearly the same place, with both values."""
    return all(
        abs(one[a.name] - other[a.name]) <= near * max(abs(one[a.name]), abs(other[a.name]), a.smallest)
        for a in effect.amplitudes
    ) and all(abs(one[c.name] - other[c.name]) <= near * (c.upper - c.lower) for c in effect.constants)


def _finer_forms(comparison: Comparison, pairs: Sequence[Candidate]) -> list[Hypothesis]:
    """Return the starts of pairs of the same labels in other forms, where the best leaves something or has a rival."""
    context, settings, best = comparison.context, comparison.settings, pairs[0]
    close = [pair for pair in pairs if pair.log_evidence > best.log_evidence - settings.close]
    rivals = list(dict.fromkeys(frozenset(pair.labels) for pair in close))[: settings.rivals]
    if len(rivals) == 1 and comparison.table.is_whole(best):
        return []
    labels = frozenset().union(*rivals)
    known = {trial.signature.effect.name for trial in comparison.trials}
    new = [effect for effect in elaborations(context.catalogue, labels) if effect.name not in known]
    trials = [trial for trial in comparison.trials if trial.signature.effect.label in labels]
    if new:
        trials += screen(context, new)
    tried = {_names(pair.fit.hypothesis) for pair in pairs}
    likeliest = likeliest_pairs(context, trials)
    least = comparison.table.least_of_two(comparison.candidates[0])
    finer = [
        one
        for one in likeliest
        if one.log_evidence >= least and one.labels in rivals and _names(one.hypothesis) not in tried
    ]
    return [one.hypothesis for one in finer[: settings.finer]]


def _names(hypothesis: Hypothesis) -> frozenset[str]:
    return frozenset(effect.name for effect in hypothesis.effects)
