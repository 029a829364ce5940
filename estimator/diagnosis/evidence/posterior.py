"""From evidences to probabilities: of each label, of none, of something unknown, and of two causes at once."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from scipy.special import logsumexp

from estimator.diagnosis.model.labels import NONE, UNKNOWN

# Prior of no gap, and of a cause outside the catalogue; the labels share the rest equally.
_PRIOR_NONE, _PRIOR_UNKNOWN = 0.5, 0.11
# Of a label's prior this share is for an effect too small to show. With these, some 80 % are left to none where
# nothing stands out: of 20 sealed cases of two seeds that were called "none" with 36 to 77 % where its prior was 0.4,
# 16 had none; of 18 of two other seeds, with 67 to 74 %, 16.
_TOO_SMALL = 0.05
# A second cause has this prior: as often a set of sealed cases with a cause holds two.
LOG_PRIOR_OF_A_PAIR = float(np.log(0.16))
_CREDIBLE = 0.9
# Share of what the best explanation gains by which evidences may be wrong, down to a least power: on cases whose
# answers were known these ranked the most right, and where thousands were gained a lead of thirty was right.
_INEXACT, _LEAST_POWER = 0.02, 0.15


def log_priors(labels: Collection[str]) -> dict[str, float]:
    """Return the log prior of every answer."""
    rest = 1.0 - _PRIOR_NONE - _PRIOR_UNKNOWN
    found = dict.fromkeys(labels, float(np.log(rest / len(labels))))
    found[NONE], found[UNKNOWN] = float(np.log(_PRIOR_NONE)), float(np.log(_PRIOR_UNKNOWN))
    return found


def probabilities(log_evidence: Mapping[str, float]) -> dict[str, float]:
    """Return the probability of every answer, the most probable first.

    An effect may be there and too small to show: then the measurements are as probable as without any.

    Parameters
    ----------
    log_evidence : of each label, were it to show, of none and of unknown
    """
    labels = log_evidence.keys() - {NONE, UNKNOWN}
    prior, power = log_priors(labels), temper(log_evidence)
    score = {name: power * value + prior[name] for name, value in log_evidence.items()}
    for name in labels:
        hidden = np.log(_TOO_SMALL) + power * log_evidence[NONE] + prior[name]
        score[name] = float(np.logaddexp(hidden, np.log1p(-_TOO_SMALL) + score[name]))
    total = float(logsumexp(list(score.values())))
    ordered = sorted(score.items(), key=lambda item: -item[1])
    return {name: float(np.exp(value - total)) for name, value in ordered}


def temper(log_evidence: Mapping[str, float]) -> float:
    """Return the power to which evidences are raised: less than one where much is explained.

    Signatures are inexact, and so are differences between evidences, by a share of what the best of them explains.
    """
    return power_at(max(log_evidence.values()) - log_evidence[NONE])


def power_at(gain: float) -> float:
    """Return the same where the best explanation gains so much log evidence."""
    return max(1.0 / (1.0 + _INEXACT * max(gain, 0.0)), _LEAST_POWER)


def shared_with_unknown(
    probability: Mapping[str, float], leading: str, explained: float, beyond: float
) -> dict[str, float]:
    """Return the probabilities where something unknown stands out beside the leading cause, the most probable first.

    A cause that explains a part of a gap may be there, or stand in for one that the catalogue does not hold: the
    unknown takes the share of its probability that it has in what both explain.

    Parameters
    ----------
    explained, beyond : by how much the cause raises the log evidence, and the unknown beside it once more
    """
    share = beyond / (beyond + max(explained, 0.0))
    shared = {
        **probability,
        leading: (1.0 - share) * probability[leading],
        UNKNOWN: probability[UNKNOWN] + share * probability[leading],
    }
    return dict(sorted(shared.items(), key=lambda item: -item[1]))


def credible_set(probability: Mapping[str, float]) -> tuple[str, ...]:
    """Return the smallest set of answers that holds 90 % of the probability."""
    chosen: list[str] = []
    total = 0.0
    for name, value in sorted(probability.items(), key=lambda item: -item[1]):
        chosen.append(name)
        total += value
        if total >= _CREDIBLE:
            break
    return tuple(chosen)


def of_labels(forms: Sequence[tuple[str, str, float]], none: float) -> dict[str, float]:
    """Return the log evidence of each label: the mean of its forms, each of which is as likely beforehand.

    Forms that explain alike support one another, and one that alone explains is charged for the choice among them.
    Evidences are tempered before the mean is taken, and it is released of that again: the charge is one of priors.

    Parameters
    ----------
    forms : label, name and log evidence of each start of each form; of a form, the best start counts
    none : log evidence of none
    """
    best: dict[str, dict[str, float]] = {}
    for label, name, value in forms:
        of_label = best.setdefault(label, {})
        of_label[name] = max(of_label.get(name, -np.inf), value)
    power = temper({NONE: none, **{label: max(values.values()) for label, values in best.items()}})
    return {
        label: float(logsumexp([power * value for value in values.values()]) - np.log(len(values))) / power
        for label, values in best.items()
    }
