"""What a cause leaves for another one, to first order beside it."""

from __future__ import annotations

from collections.abc import Sequence

from estimator.diagnosis.case import Case
from estimator.diagnosis.contest import Contender, Trial, first_order_evidence, trials_of
from estimator.diagnosis.discrepancy import ModelError
from estimator.diagnosis.findings import best_trials
from estimator.diagnosis.hypothesis import Hypothesis

# A second cause must raise the log evidence by this, beyond its prior: less than that the baseline's own error feigns.
SECOND_CAUSE = 15.0


def promising_pairs(
    case: Case, leader: Contender, trials: Sequence[Trial], error: ModelError
) -> list[tuple[float, Hypothesis]]:
    """Return what every worthwhile second effect would raise the leader's log evidence to, and where its refit starts.

    The most promising comes first. Every start of ``trials`` is weighed anew: where the leader's gap is large, a second
    cause seemed to lie elsewhere.
    """
    others = [trial.signature for trial in trials if trial.signature.effect.label not in leader.labels]
    tried = best_trials(trials_of(case, leader.fit, error, others)).values()
    alone = first_order_evidence(case, leader.fit, error)
    found = [
        (trial.log_evidence - alone + leader.log_evidence, trial.start)
        for trial in tried
        if trial.log_evidence > alone + SECOND_CAUSE
    ]
    return sorted(found, key=lambda pair: -pair[0])
