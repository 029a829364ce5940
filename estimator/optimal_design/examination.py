"""What experiments so far say, screened in seconds or diagnosed in full; also those in which nothing was strained."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.diagnose import concluded
from estimator.diagnosis.evidence.posterior import probabilities
from estimator.diagnosis.model.labels import NONE, UNKNOWN
from estimator.diagnosis.result import Diagnosis
from estimator.diagnosis.screened import screened
from estimator.diagnosis.search.baseline import Preparation
from estimator.diagnosis.search.comparison import Comparison
from estimator.diagnosis.search.context import Tell
from estimator.diagnosis.search.decision import weigh
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.effects.catalogue import default_catalogue
from estimator.experiment import Experiment
from estimator.fit.settings import FitSettings
from estimator.inference.laplace import log_mean
from estimator.optimal_design.beliefs import beliefs_of
from estimator.optimal_design.foreseeing import foresee_unstrained, seen_unstrained
from estimator.optimal_design.information import log_evidence, updated


@dataclass(frozen=True, eq=False)
class Examination:
    """What experiments say.

    Attributes
    ----------
    preparation, comparison : of those in which tissue was strained
    unstrained : experiments in which nothing was strained: a still minute, or what was done in the air
    probability : of every answer, the most probable first, with all experiments
    diagnosis : of those in which tissue was strained; None where they were screened alone
    """

    preparation: Preparation
    comparison: Comparison
    unstrained: tuple[Experiment, ...]
    probability: Mapping[str, float]
    diagnosis: Diagnosis | None = None

    @property
    def leading(self) -> str:
        """The most probable answer."""
        return next(iter(self.probability))


def examine(
    strained: Sequence[Experiment],
    unstrained: Sequence[Experiment],
    executor: Executor,
    tell: Tell,
    material: FitSettings | None = None,
) -> Examination:
    """Screen experiments of one phantom in one mounting, which takes seconds.

    Parameters
    ----------
    strained : in which the gripper strained the tissue, one at least
    unstrained : in which nothing was strained
    executor : the workers
    tell : told what is being done
    material : the tissue's law, and what is known of it beforehand

    Raises
    ------
    InputError, FitError, SolverError
        As :func:`estimator.diagnosis.diagnose.diagnose`.
    """
    settings = DiagnosisSettings()
    preparation, comparison = screened(
        strained, settings, default_catalogue(), material or FitSettings(), executor, tell
    )
    probability = probabilities(weigh(comparison), settings.evidence)
    return _with_all(Examination(preparation, comparison, tuple(unstrained), probability))


def examine_in_full(examination: Examination) -> Examination:
    """Refit the leading causes of experiments that were screened, which takes a minute; their workers still work.

    Raises
    ------
    SolverError
        The baseline has no equilibrium.
    """
    comparison, diagnosis = concluded(examination.preparation, examination.comparison)
    return _with_all(
        replace(examination, comparison=comparison, probability=diagnosis.probabilities, diagnosis=diagnosis)
    )


def _with_all(examination: Examination) -> Examination:
    """Return an examination of strained tissue with what was read while nothing was strained."""
    probability = examination.probability
    for one in examination.unstrained:
        probability = _with_unstrained(examination.comparison, probability, one)
    return replace(examination, probability=_most_probable_first(probability))


def _with_unstrained(
    comparison: Comparison, probability: Mapping[str, float], measured: Experiment
) -> dict[str, float]:
    """Return the probabilities after what was read while nothing was strained.

    An answer that is not reckoned with one by one has no part in such readings: it foresees what none does. Something
    unknown is as likely to show in them as not.
    """
    beliefs = beliefs_of(comparison, probability)
    labels_of_beliefs = [one.label for one in beliefs]
    foreseen = foresee_unstrained(comparison, beliefs, measured)
    shown = foresee_unstrained(comparison, beliefs, measured, unknown_shows=True)
    unknown_shown = shown[labels_of_beliefs.index(UNKNOWN)]
    *logs, of_shown = log_evidence([*foreseen, unknown_shown], seen_unstrained(comparison, measured)).tolist()
    of_answer = dict(zip(labels_of_beliefs, logs, strict=True))
    of_none = of_answer[NONE]
    of_answer[UNKNOWN] = log_mean([of_none, of_shown])
    labels = list(probability)
    after = updated(
        [probability[label] for label in labels],
        np.array([of_answer.get(label, of_none) for label in labels]),
    )
    return dict(zip(labels, after.tolist(), strict=True))


def _most_probable_first(probability: Mapping[str, float]) -> dict[str, float]:
    return dict(sorted(probability.items(), key=lambda item: -item[1]))
