"""What a cause leaves for another one, to first order beside it."""

from __future__ import annotations

from collections.abc import Sequence

from estimator.diagnosis.case import Case
from estimator.diagnosis.contest import Contender, Trial, first_order_evidence, trials_of
from estimator.diagnosis.discrepancy import ModelError
from estimator.diagnosis.findings import best_trials
from estimator.diagnosis.hypothesis import Hypothesis

# A second cause must raise the log evidence by this, beyond its prior, and by this share of what the first one does:
# a form that is nearly right leaves a little of a large gap, which another effect then seems to explain.
_SECOND_CAUSE, _INEXACT = 9.0, 4e-4


def least_gain(explained: float) -> float:
    """Return by how much a second cause must raise the log evidence beside one that raises it by ``explained``."""
    return _SECOND_CAUSE + _INEXACT * max(explained, 0.0)


def promising_pairs(
    case: Case, leader: Contender, trials: Sequence[Trial], error: ModelError, none: float
) -> list[tuple[float, Hypothesis]]:
    """Return what every worthwhile second effect would raise the leader's log evidence to, and where its refit starts.

    The most promising comes first. Every start of ``trials`` is weighed anew: where the leader's gap is large, a second
    cause seemed to lie elsewhere. ``none`` is the log evidence without any cause.
    """
    others = [trial.signature for trial in trials if trial.signature.effect.label not in leader.labels]
    tried = best_trials(trials_of(case, leader.fit, error, others)).values()
    alone = first_order_evidence(case, leader.fit, error)
    bar = alone + least_gain(leader.log_evidence - none)
    found = [
        (trial.log_evidence - alone + leader.log_evidence, trial.start)
        for trial in tried
        if trial.log_evidence > bar
    ]
    return sorted(found, key=lambda pair: -pair[0])
