"""From evidences to probabilities: of each label, of none, of something unknown, and of two causes at once."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from scipy.special import logsumexp

from estimator.diagnosis.model.labels import NONE, UNKNOWN
from estimator.diagnosis.settings import EvidenceSettings


def log_priors(labels: Collection[str], settings: EvidenceSettings) -> dict[str, float]:
    """Return the log prior of every answer: the labels share what none and unknown leave equally."""
    none, unknown = settings.prior_of_none, settings.prior_of_unknown
    rest = 1.0 - none - unknown
    found = dict.fromkeys(labels, float(np.log(rest / len(labels))))
    found[NONE], found[UNKNOWN] = float(np.log(none)), float(np.log(unknown))
    return found


def probabilities(
    log_evidence: Mapping[str, float], settings: EvidenceSettings, feigned: float = 0.0
) -> dict[str, float]:
    """Return the probability of every answer, the most probable first.

    An effect may be there and too small to show: then the measurements are as probable as without any.

    Parameters
    ----------
    log_evidence : of each label, were it to show, of none and of unknown
    settings : EvidenceSettings
    feigned : by how much that of none rises for what the model's own error could feign
    """
    labels = log_evidence.keys() - {NONE, UNKNOWN}
    prior, power = log_priors(labels, settings), temper(log_evidence, settings)
    hidden_share = settings.too_small_to_show
    log_evidence = {**log_evidence, NONE: log_evidence[NONE] + feigned}
    score = {name: power * value + prior[name] for name, value in log_evidence.items()}
    for name in labels:
        hidden = np.log(hidden_share) + power * log_evidence[NONE] + prior[name]
        score[name] = float(np.logaddexp(hidden, np.log1p(-hidden_share) + score[name]))
    total = float(logsumexp(list(score.values())))
    ordered = sorted(score.items(), key=lambda item: -item[1])
    return {name: float(np.exp(value - total)) for name, value in ordered}


def temper(log_evidence: Mapping[str, float], settings: EvidenceSettings) -> float:
    """Return the power to which evidences are raised: less than one where much is explained.

    Signatures are inexact, and so are differences between evidences, by a share of what the best of them explains.
    """
    return power_at(max(log_evidence.values()) - log_evidence[NONE], settings)


def power_at(gain: float, settings: EvidenceSettings) -> float:
    """Return the same where the best explanation gains so much log evidence."""
    return max(1.0 / (1.0 + settings.tempering * max(gain, 0.0)), settings.least_power)


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
    share = beyond / max(beyond + max(explained, 0.0), np.finfo(float).tiny)
    shared = {
        **probability,
        leading: (1.0 - share) * probability[leading],
        UNKNOWN: probability[UNKNOWN] + share * probability[leading],
    }
    return dict(sorted(shared.items(), key=lambda item: -item[1]))


def credible_set(probability: Mapping[str, float], credible: float) -> tuple[str, ...]:
    """Return the smallest set of answers that holds so much of the probability."""
    chosen: list[str] = []
    total = 0.0
    for name, value in sorted(probability.items(), key=lambda item: -item[1]):
        chosen.append(name)
        total += value
        if total >= credible:
            break
    return tuple(chosen)


def of_labels(
    forms: Sequence[tuple[str, str, float]], none: float, settings: EvidenceSettings
) -> dict[str, float]:
    """Return the log evidence of each label: the mean of its forms, each of which is as likely beforehand.

    Forms that explain alike support one another, and one that alone explains is charged for the choice among them.
    Evidences are tempered before the mean is taken, and it is released of that again: the charge is one of priors.

    Parameters
    ----------
    forms : label, name and log evidence of each start of each form; of a form, the best start counts
    none : log evidence of none
    settings : EvidenceSettings
    """
    best: dict[str, dict[str, float]] = {}
    for label, name, value in forms:
        of_label = best.setdefault(label, {})
        of_label[name] = max(of_label.get(name, -np.inf), value)
    power = temper({NONE: none, **{label: max(values.values()) for label, values in best.items()}}, settings)
    return {
        label: float(logsumexp([power * value for value in values.values()]) - np.log(len(values))) / power
        for label, values in best.items()
    }


def no_likelier_than_solved(probability: Mapping[str, float], unsolved: Sequence[str]) -> Mapping[str, float]:
    """Return the probabilities with no answer that could not be solved above the most probable one that was."""
    most = max(value for label, value in probability.items() if label not in unsolved)
    kept = {label: min(value, most) for label, value in probability.items()}
    total = sum(kept.values())
    ordered = sorted(kept.items(), key=lambda item: (-item[1], item[0] in unsolved))
    return {label: value / total for label, value in ordered}
