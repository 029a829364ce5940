"""What experiments so far say, screened in seconds or diagnosed in full; also those in which nothing was strained."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from estimator.diagnosis.diagnose import concluded
from estimator.diagnosis.evidence.posterior import probabilities
from estimator.diagnosis.model.labels import NONE
from estimator.diagnosis.result import Diagnosis
from estimator.diagnosis.screened import screened
from estimator.diagnosis.search.comparison import Comparison
from estimator.diagnosis.search.context import Tell
from estimator.diagnosis.search.decision import weigh
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.effects.catalogue import default_catalogue
from estimator.experiment import Experiment
from estimator.fit.settings import FitSettings
from estimator.optimal_design.beliefs import beliefs_of
from estimator.optimal_design.foreseeing import foresee_unstrained, seen_unstrained
from estimator.optimal_design.information import log_evidence, updated


@dataclass(frozen=True, eq=False)
class Examination:
    """What experiments say.

    Attributes
    ----------
    comparison : of those in which tissue was strained
    probability : of every answer, the most probable first, with all experiments
    diagnosis : of those in which tissue was strained; None where they were screened alone
    """

    comparison: Comparison
    probability: Mapping[str, float]
    diagnosis: Diagnosis | None = None

    @property
    def leading(self) -> str:
        """The most probable answer."""
        return next(iter(self.probability))


def examine(
    strained: Sequence[Experiment],
    unstrained: Sequence[Experiment],
    in_full: bool,
    executor: Executor,
    tell: Tell,
    material: FitSettings | None = None,
) -> Examination:
    """Examine experiments of one phantom in one mounting.

    Parameters
    ----------
    strained : in which the gripper strained the tissue, one at least
    unstrained : in which nothing was strained: a still minute, or what was done in the air
    in_full : whether the leading causes are refitted, which takes a minute, or screened alone
    executor : the workers
    tell : told what is being done
    material : the tissue's law, and what is known of it beforehand

    Raises
    ------
    InputError, FitError, SolverError
        As :func:`estimator.diagnosis.diagnose.diagnose`.
    """
    settings = DiagnosisSettings()
    diagnosis: Diagnosis | None = None
    preparation, comparison = screened(
        strained, settings, default_catalogue(), material or FitSettings(), executor, tell
    )
    probability: Mapping[str, float] = probabilities(weigh(comparison), settings.evidence)
    if in_full:
        comparison, diagnosis = concluded(preparation, comparison)
        probability = diagnosis.probabilities
    for one in unstrained:
        probability = _with_unstrained(comparison, probability, one)
    return Examination(comparison, _most_probable_first(probability), diagnosis)


def _with_unstrained(
    comparison: Comparison, probability: Mapping[str, float], measured: Experiment
) -> dict[str, float]:
    """Return the probabilities after what was read while nothing was strained.

    An answer that is not reckoned with one by one has no part in such readings: it foresees what none does.
    """
    beliefs = beliefs_of(comparison, probability)
    foreseen = foresee_unstrained(comparison, beliefs, measured)
    logs = log_evidence(foreseen, seen_unstrained(comparison, measured))
    of_answer = {one.label: float(value) for one, value in zip(beliefs, logs, strict=True)}
    of_none = of_answer[NONE]
    labels = list(probability)
    after = updated(
        [probability[label] for label in labels],
        np.array([of_answer.get(label, of_none) for label in labels]),
    )
    return dict(zip(labels, after.tolist(), strict=True))


def _most_probable_first(probability: Mapping[str, float]) -> dict[str, float]:
    return dict(sorted(probability.items(), key=lambda item: -item[1]))
