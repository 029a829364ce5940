"""Diagnoses every case of a set without its answers, going on where an earlier call stopped."""

import json
import os
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from estimator.batch import Batch, Tell, run_batch
from estimator.blind.scoring.ceiling import as_json as ceilings_as_json
from estimator.blind.scoring.ceiling import ceilings
from estimator.diagnosis.conclusions.as_json import as_json
from estimator.diagnosis.result import Diagnosis
from estimator.experiment import Experiment
from estimator.workers import Workers

Diagnose = Callable[[Sequence[Experiment], Tell | None], Diagnosis]


def answer_cases(
    diagnose: Diagnose,
    cases: Path,
    answers: Path,
    *,
    workers: Workers | None = None,
    progress: Tell = lambda text, done, total: None,
) -> Batch:
    """Diagnose the cases in a folder that have no answer yet; of a case, only its experiments are read.

    Parameters
    ----------
    diagnose : a function at the top of a module, which other processes can find
    cases : folder of cases, each a folder of experiments
    answers : folder for one file a case, ``CASE.json``, which appears when its case is done: the diagnosis, how
        often the best possible test would name each cause, and the processor time spent, s
    workers : that take a case each; by default one case is diagnosed after another
    progress : hears a text, and how many of how many cases are done

    Raises
    ------
    InputError, WorkersLostError
        As :func:`~estimator.batch.run_batch`.
    """

    def files(name: str) -> list[Path]:
        return [answers / f"{name}.json"]

    return run_batch(partial(_answer, diagnose), cases, files, workers=workers, progress=progress)


def _answer(diagnose: Diagnose, name: str, experiments: Sequence[Experiment]) -> list[str]:
    """Return the text of the answer to a case, whose name tells nothing."""
    before = _processor_s()
    found = diagnose(experiments, None)
    told = {
        **as_json(found),
        "ceiling": ceilings_as_json(ceilings(found.rivals)),
        "processor_seconds": round(_processor_s() - before, 2),
    }
    return [json.dumps(told, indent=1)]


def _processor_s() -> float:
    """Return the processor time of this process and of those that it has started and that have ended, s."""
    used = os.times()
    return used.user + used.system + used.children_user + used.children_system
