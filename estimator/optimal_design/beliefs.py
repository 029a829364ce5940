"""What is believed under each answer that a diagnosis has left: its probability, its parameters and their spread."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.fitting.case import Linearisation
from estimator.diagnosis.model.labels import NONE, UNKNOWN
from estimator.diagnosis.search.candidate import Candidate
from estimator.diagnosis.search.comparison import Comparison
from estimator.diagnosis.search.screening import Trial, beside, best_trials
from estimator.effects.effect import Effect
from estimator.inference.free_parameter import prior_information
from estimator.inference.linear_model import chi2_of

FloatArray = NDArray[np.float64]

# Answers less probable than this share are not reckoned with, nor more than so many labels.
LEAST_PROBABILITY = 0.005
MOST_LABELS = 10
# An unknown misfit is taken to be no smaller than this in what comes, in units of a reading's noise.
_LEAST_UNEXPLAINED = 0.5


@dataclass(frozen=True, eq=False)
class Belief:
    """One answer.

    Attributes
    ----------
    label : of the catalogue, or none or unknown
    probability : that it is the right one
    effect, constants : the cause in its best form; None and none where there is none
    mean : (f + k,) by what E and ν, as far as they are free, and the amplitudes differ from the fitted baseline and
        from none, internal units
    root : (f + k, f + k) root of their covariance
    unexplained : amplitude of a smooth misfit that nothing named explains, in units of a reading's noise
    """

    label: str
    probability: float
    effect: Effect | None
    constants: Mapping[str, float]
    mean: FloatArray
    root: FloatArray
    unexplained: float = 0.0


def beliefs_of(comparison: Comparison, probability: Mapping[str, float]) -> tuple[Belief, ...]:
    """Return what is believed under the answers that are probable enough, none and unknown always among them.

    A refitted cause is where its refit has left it; one that was screened where its signature lets expect it.

    Parameters
    ----------
    comparison : of the experiments so far
    probability : of every answer
    """
    baseline = comparison.context.baseline
    trials = best_trials(comparison.trials_of_labels)
    refitted: dict[str, Candidate] = {}
    for one in comparison.candidates:
        if len(one.labels) == 1:
            refitted.setdefault(one.labels[0], one)
    likely = sorted(
        (label for label in probability if label in trials), key=lambda label: -probability[label]
    )
    found = [
        _of_refitted(baseline, refitted[label], probability[label])
        if label in refitted
        else _of_trial(baseline, trials[label], probability[label])
        for label in likely[:MOST_LABELS]
        if probability[label] >= LEAST_PROBABILITY
    ]
    root = _root(_information(baseline.jacobian, prior_information(baseline.free_parameters)))
    at_best = np.zeros(len(root))
    beyond_noise = chi2_of(baseline.residual) / max(sum(map(len, baseline.residual)), 1) - 1.0
    unexplained = max(float(np.sqrt(max(beyond_noise, 0.0))), _LEAST_UNEXPLAINED)
    return (
        *found,
        Belief(NONE, probability[NONE], None, {}, at_best, root),
        Belief(UNKNOWN, probability[UNKNOWN], None, {}, at_best, root, unexplained),
    )


def _of_trial(baseline: Linearisation, trial: Trial, probability: float) -> Belief:
    fit, signature = beside(baseline, trial.signature), trial.signature
    mean = [one.of(trial.start).internal - one.of(fit.hypothesis).internal for one in fit.free_parameters]
    information = _information(fit.jacobian, prior_information(fit.free_parameters))
    return Belief(
        signature.effect.label,
        probability,
        signature.effect,
        signature.constants,
        np.array(mean),
        _root(information),
    )


def _of_refitted(baseline: Linearisation, candidate: Candidate, probability: float) -> Belief:
    fit = candidate.fit
    (effect,), (values,) = fit.hypothesis.effects, fit.hypothesis.values
    amplitudes = [one.name for one in effect.amplitudes]
    kept = [
        number
        for number, one in enumerate(fit.free_parameters)
        if one.effect is None or one.key in amplitudes
    ]
    covariance = _inverse(_information(fit.jacobian, prior_information(fit.free_parameters)))
    mean = [
        one.internal - (_internal(one.key, baseline) if one.effect is None else 0.0)
        for one in (fit.free_parameters[number] for number in kept)
    ]
    return Belief(
        effect.label,
        probability,
        effect,
        {key: value for key, value in values.items() if key not in amplitudes},
        np.array(mean),
        _root_of(covariance[np.ix_(kept, kept)]),
    )


def _internal(name: str, baseline: Linearisation) -> float:
    """Return a parameter of the baseline's material, internal units."""
    (found,) = (one for one in baseline.free_parameters if one.effect is None and one.key == name)
    return found.of(baseline.hypothesis).internal


def _information(jacobian: Sequence[FloatArray], prior: FloatArray) -> FloatArray:
    found: FloatArray = np.asarray(prior + np.sum([block.T @ block for block in jacobian], axis=0))
    # What neither measurements nor priors tell stays as good as unknown.
    return np.asarray(found + 1e-9 * np.diag(np.maximum(np.diag(found), 1e-3)))


def _root(information: FloatArray) -> FloatArray:
    return _root_of(_inverse(information))


def _root_of(covariance: FloatArray) -> FloatArray:
    symmetric = 0.5 * (covariance + covariance.T)
    return np.asarray(np.linalg.cholesky(symmetric), dtype=np.float64)


def _inverse(matrix: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.inv(matrix), dtype=np.float64)
