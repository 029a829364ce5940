r"""Probabilities of causes from their evidences, and what may be said of them.

Evidences e of inexact models are tempered by what the best explains, as in the diagnosis of retractions:

    p ∝ π exp(β e),  β = max(1 / (1 + (e_best - e_none) / 50), 0.15)

π is 0.5 for none and 0.11 for unknown; the causes share the rest, and two causes together have a twentieth of each.
Forms of one cause count as their mean.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from estimator.uniaxial.diagnosis.causes import NONE, UNKNOWN
from estimator.uniaxial.diagnosis.evidence import Weighed

_PRIOR_NONE, _PRIOR_UNKNOWN, _SECOND_CAUSE = 0.5, 0.11, 0.05
_EXPLAINED, _LEAST_SHARE = 50.0, 0.15
_MOST_LEFT_TO_NONE = 0.2
_ALIKE = 0.25  # of the leader's probability

Answer = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Ranking:
    """Probabilities of answers, the highest first, and the best form of each."""

    probabilities: dict[Answer, float]
    best: dict[Answer, Weighed]

    @property
    def leader(self) -> Answer:
        """The answer to name: none while it has a fifth."""
        if self.probabilities[(NONE,)] > _MOST_LEFT_TO_NONE:
            return (NONE,)
        return next(answer for answer in self.probabilities if answer != (NONE,))

    @property
    def plausible(self) -> tuple[Answer, ...]:
        """The leader and what is nearly as probable, which the tests do not tell from it."""
        if self.leader == (NONE,):
            return (self.leader,)
        least = _ALIKE * self.probabilities[self.leader]
        return tuple(one for one, p in self.probabilities.items() if p >= least and one != (NONE,))

    @property
    def shared(self) -> Answer:
        """The causes that all plausible answers have in common; where they have none, the leader."""
        shared = tuple(label for label in self.leader if all(label in one for one in self.plausible))
        return shared or self.leader

    def probability_of(self, label: str) -> float:
        """Return the probability that a cause has a part in the gap."""
        return sum(p for answer, p in self.probabilities.items() if label in answer)


def ranked(weighed: Sequence[Weighed], unknown: Weighed, labels: Sequence[str]) -> Ranking:
    """Rank all that was weighed.

    Parameters
    ----------
    weighed : none, single causes and pairs
    labels : of all single causes that were tried
    """
    groups: dict[Answer, list[Weighed]] = {}
    for one in weighed:
        groups.setdefault(tuple(sorted(set(one.labels))), []).append(one)
    groups[(UNKNOWN,)] = [unknown]
    none = groups[(NONE,)][0].log_evidence
    top = max(one.log_evidence for group in groups.values() for one in group)
    beta = max(1 / (1 + max(top - none, 0.0) / _EXPLAINED), _LEAST_SHARE)
    each = (1 - _PRIOR_NONE - _PRIOR_UNKNOWN) / max(len(labels), 1)
    logs = {}
    for answer, group in groups.items():
        special: dict[Answer, float] = {(NONE,): _PRIOR_NONE, (UNKNOWN,): _PRIOR_UNKNOWN}
        prior = special.get(answer, each if len(answer) == 1 else each * _SECOND_CAUSE)
        evidence = logsumexp([beta * one.log_evidence for one in group]) - np.log(len(group))
        logs[answer] = float(np.log(prior) + evidence)
    total = logsumexp(list(logs.values()))
    order = sorted(logs, key=lambda answer: -logs[answer])
    return Ranking(
        {answer: float(np.exp(logs[answer] - total)) for answer in order},
        {answer: max(group, key=lambda one: one.log_evidence) for answer, group in groups.items()},
    )


def named(answer: Answer) -> str:
    """Return an answer in words."""
    return " with ".join(label.replace("_", " ") for label in answer)
