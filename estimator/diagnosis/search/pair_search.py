"""The search for two causes: pairs are refitted, in finer forms where they leave something or rival each other."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.search.candidate import Candidate, best_of_labels, most_probable_first
from estimator.diagnosis.search.comparison import ALIKE, Comparison
from estimator.diagnosis.search.pair_screening import likeliest_pairs
from estimator.diagnosis.search.racing import is_linear, race
from estimator.diagnosis.search.refinements import elaborations, mistaken_for
from estimator.diagnosis.search.screening import Tell, best_starts, screen
from estimator.diagnosis.search.second_cause import (
    adequate,
    least_gain,
    least_of_two,
    promising_seconds,
    starts_of_pairs,
)
from estimator.effects.effect import Effect, Values

_LEADERS = 2
# Pairs this close to the best are its rivals; one more of them is looked at in finer forms, and so many forms in all.
_CLOSE = 10.0
_RIVALS, _FINER = 2, 4
# So many more labels are tried beside the best pair's second cause, and so many more beside its first one.
_MORE = 2
_ADDS_LITTLE = 8.0
# A second cause that promises this share of what the best pair adds to its first one may be that after its refit.
_PASSED_OVER = 0.5
# Sizes of an effect that differ by no more than this share, and places within this share of their range, are one.
_NEAR = 0.25


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


def search_pairs(comparison: Comparison, best: Candidate, executor: Executor, tell: Tell) -> Found:
    """Look for a second cause beside the leaders of a comparison, of which ``best`` is what a pair has to beat."""
    leaders = best_of_labels(comparison.candidates)[:_LEADERS]
    pairs = _refitted(comparison, leaders, best, executor, tell)
    found = _led_on(comparison, best, pairs, executor, tell)
    alone = most_probable_first([best, *found])[0]
    if alone is not best:
        pairs = _refitted(comparison, best_of_labels([alone, *leaders])[:_LEADERS], alone, executor, tell)
    # Where the best pair adds little, or falls short of the unknown, other forms of its causes will not do either.
    least = alone.log_evidence + _ADDS_LITTLE
    if pairs and pairs[0].log_evidence > least:
        pairs = _with_more(
            comparison, pairs, beside_what_ties(comparison, pairs), pairs[0].log_evidence, executor, tell
        )
        promised = alone.log_evidence + _PASSED_OVER * (pairs[0].log_evidence - alone.log_evidence)
        pairs = _with_more(
            comparison, pairs, passed_over(comparison, pairs, promised), promised, executor, tell
        )
    if pairs and pairs[0].log_evidence > max(comparison.unknown, least):
        finer = _finer_forms(comparison, pairs, executor, tell)
        pairs = _with_more(comparison, pairs, finer, pairs[0].log_evidence, executor, tell)
        refitted = replace(
            comparison, candidates=tuple(most_probable_first([*comparison.candidates, *found]))
        )
        alone = most_probable_first([alone, *_led_on(refitted, alone, pairs, executor, tell)])[0]
    return Found(alone, tuple(pairs))


def _with_more(
    comparison: Comparison,
    pairs: list[Candidate],
    starts: Sequence[Hypothesis],
    bar: float,
    executor: Executor,
    tell: Tell,
) -> list[Candidate]:
    """Return the pairs, and those that a race from more starts over a bar has found, the most probable first."""
    if not starts:
        return pairs
    more = race(comparison.case, comparison.baseline, comparison.error, starts, bar, executor, tell)
    return most_probable_first([*pairs, *more])


def _refitted(
    comparison: Comparison, leaders: Sequence[Candidate], best: Candidate, executor: Executor, tell: Tell
) -> list[Candidate]:
    begun = starts_of_pairs(
        comparison.case, comparison.baseline, leaders, comparison.trials, comparison.error, comparison.none
    )
    if not begun:
        return []
    bar = best.log_evidence + least_gain(best, best.labels, comparison.none)
    return race(comparison.case, comparison.baseline, comparison.error, begun, bar, executor, tell)


def beside_what_ties(comparison: Comparison, pairs: Sequence[Candidate]) -> list[Hypothesis]:
    """Return starts of the best pair's second cause beside what ties with its first, where that pair leaves something.

    Causes that take one another's place alone may do so no longer where the second one is beside them.

    Parameters
    ----------
    pairs : refitted, one at least, the most probable first; what is among them is not begun again
    """
    if adequate(comparison.case, pairs[0], comparison.error):
        return []
    best, *others = best_of_labels(comparison.candidates)
    least = best.log_evidence - ALIKE * (best.log_evidence - comparison.none)
    alike = [one for one in others if one.log_evidence > least]
    tried = {frozenset(pair.labels) for pair in pairs}
    both = pairs[0].fit.hypothesis
    return [
        one.fit.hypothesis.with_effect(effect, values)
        for effect, values in zip(both.effects, both.values, strict=True)
        if effect.label not in {one.labels[0] for one in (best, *alike)}
        for one in alike
        if frozenset((*one.labels, effect.label)) not in tried
    ][:_MORE]


def passed_over(comparison: Comparison, pairs: Sequence[Candidate], least: float) -> list[Hypothesis]:
    """Return starts of second causes beside the best pair's first one that promised less than its second.

    First order promises too little of what is far from linear, as of fibres that bear in tension alone; of what is
    linear it promises what a refit keeps.

    Parameters
    ----------
    pairs : refitted, one at least, the most probable first; what is among them is not begun again
    least : log evidence that they promise at least
    """
    first = next((one for one in comparison.candidates if one.labels[0] in pairs[0].labels), None)
    if first is None:
        return []
    tried = {frozenset(pair.labels) for pair in pairs}
    return [
        start.hypothesis
        for start in promising_seconds(
            comparison.case, first, comparison.trials, comparison.error, comparison.none
        )
        if start.labels not in tried
        and start.log_evidence > least
        and not is_linear(start.hypothesis.effects[-1])
    ][:_MORE]


def with_what_it_is_mistaken_for(
    comparison: Comparison, pair: Candidate, executor: Executor, tell: Tell
) -> Comparison:
    """Return the comparison with what has no label refitted too, where it may pass for either cause of a pair."""
    tried = {one.fit.hypothesis.effects[0].name for one in comparison.candidates}
    effects = [one for one in mistaken_for(comparison.case, [pair]) if one.name not in tried]
    if not effects:
        return comparison
    trials = screen(comparison.case, comparison.baseline, comparison.error, effects, executor, tell)
    starts = [trial.start for trial in best_starts(trials)[:_FINER]]
    # They begin where a pair has its best place, as beside a single cause, and fall short of it by more at first.
    bar = pair.log_evidence - ALIKE * (pair.log_evidence - comparison.none)
    found = race(comparison.case, comparison.baseline, comparison.error, starts, bar, executor, tell)
    candidates = most_probable_first([*comparison.candidates, *found])
    return replace(comparison, trials=(*comparison.trials, *trials), candidates=tuple(candidates))


def _led_on(
    comparison: Comparison, best: Candidate, pairs: Sequence[Candidate], executor: Executor, tell: Tell
) -> list[Candidate]:
    """Return single causes refitted from where the best pair has led them, if that explains more than the best alone.

    What another form or another place of one cause explains is no evidence of a second one. A refit of one cause alone
    may stop where one with a second effect goes on: at a kink, where tissue comes off node by node, or far from a large
    pretension, which changes the tissue's shape.
    """
    if not pairs or pairs[0].log_evidence <= best.log_evidence:
        return []
    starts = led_on_by(pairs[0].fit.hypothesis, comparison.candidates)
    return race(
        comparison.case, comparison.baseline, comparison.error, starts, best.log_evidence, executor, tell
    )


def led_on_by(pair: Hypothesis, candidates: Sequence[Candidate]) -> list[Hypothesis]:
    """Return each cause of a pair alone, with its values there, where no refit of its form alone has come near them."""
    singles = [one.fit.hypothesis for one in candidates if len(one.labels) == 1]
    return [
        replace(pair, effects=(effect,), values=(values,))
        for effect, values in zip(pair.effects, pair.values, strict=True)
        if not any(
            one.effects[0].name == effect.name and _is_near(effect, one.values[0], values) for one in singles
        )
    ]


def _is_near(effect: Effect, one: Values, other: Values) -> bool:
    """Tell whether an effect is nearly as large, and in nearly the same place, with both values."""
    return all(
        abs(one[a.name] - other[a.name]) <= _NEAR * max(abs(one[a.name]), abs(other[a.name]), a.smallest)
        for a in effect.amplitudes
    ) and all(abs(one[c.name] - other[c.name]) <= _NEAR * (c.upper - c.lower) for c in effect.constants)


def _finer_forms(
    comparison: Comparison, pairs: Sequence[Candidate], executor: Executor, tell: Tell
) -> list[Hypothesis]:
    """Return the starts of pairs of the same labels in other forms, where the best leaves something or has a rival."""
    best = pairs[0]
    close = [pair for pair in pairs if pair.log_evidence > best.log_evidence - _CLOSE]
    rivals = list(dict.fromkeys(frozenset(pair.labels) for pair in close))[:_RIVALS]
    if len(rivals) == 1 and adequate(comparison.case, best, comparison.error):
        return []
    labels = frozenset().union(*rivals)
    known = {trial.signature.effect.name for trial in comparison.trials}
    new = [effect for effect in elaborations(labels) if effect.name not in known]
    trials = [trial for trial in comparison.trials if trial.signature.effect.label in labels]
    if new:
        trials += screen(comparison.case, comparison.baseline, comparison.error, new, executor, tell)
    tried = {_names(pair.fit.hypothesis) for pair in pairs}
    likeliest = likeliest_pairs(comparison.case, comparison.baseline, comparison.error, trials)
    least = least_of_two(comparison.candidates[0].log_evidence, comparison.none)
    finer = [
        one
        for one in likeliest
        if one.log_evidence >= least and one.labels in rivals and _names(one.hypothesis) not in tried
    ]
    return [one.hypothesis for one in finer[:_FINER]]


def _names(hypothesis: Hypothesis) -> frozenset[str]:
    return frozenset(effect.name for effect in hypothesis.effects)
