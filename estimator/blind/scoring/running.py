"""Diagnoses every case of a set without its answers, going on where an earlier call stopped."""

import json
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from estimator.blind.scoring.ceiling import as_json as ceilings_as_json
from estimator.blind.scoring.ceiling import ceilings
from estimator.diagnosis.conclusions.as_json import as_json
from estimator.diagnosis.result import Diagnosis
from estimator.errors import EstimatorError, InputError
from estimator.experiment import Experiment, read_case
from estimator.experiment.model import EXPERIMENT_FILE
from estimator.workers import worker_pool

Tell = Callable[[str, int, int], None]
Diagnose = Callable[[Sequence[Experiment], Tell | None], Diagnosis]


@dataclass(frozen=True, slots=True)
class AnsweredSet:
    """What a call did: names of the cases answered, of those that had been, and what failed, by name."""

    answered: tuple[str, ...]
    present: tuple[str, ...]
    failed: dict[str, str]


def answer_cases(
    diagnose: Diagnose,
    cases: Path,
    answers: Path,
    *,
    processes: int = 1,
    progress: Tell = lambda text, done, total: None,
) -> AnsweredSet:
    """Diagnose the cases in a folder that have no answer yet; of a case, only its experiments are read.

    Parameters
    ----------
    diagnose : a function at the top of a module, which other processes can find
    cases : folder of cases, each a folder of experiments
    answers : folder for one file a case, ``CASE.json``, which appears when its case is done: the diagnosis, how
        often the best possible test would name each cause, and the processor time spent, s
    processes : cases at a time
    progress : hears a text, and how many of how many cases are done

    Raises
    ------
    InputError
        The folder holds no case, or one that cannot be read; nothing is diagnosed or written then.
    """
    names = case_names(cases)
    present = tuple(name for name in names if _answer_file(answers, name).exists())
    missing = [name for name in names if name not in present]
    for name in missing:  # what cannot be read is told before hours of work, not after
        read_case(cases / name)
    answers.mkdir(parents=True, exist_ok=True)
    answered: list[str] = []
    failed: dict[str, str] = {}
    progress("diagnosing cases", len(present), len(names))
    work = partial(_answer, diagnose, cases, answers)
    for name, failure in _at_a_time(work, missing, processes) if processes > 1 else _in_turn(work, missing):
        if failure:
            failed[name] = failure
        else:
            answered.append(name)
        progress(f"diagnosed {name}", len(present) + len(answered) + len(failed), len(names))
    return AnsweredSet(tuple(sorted(answered)), present, failed)


def case_names(folder: Path) -> list[str]:
    """Return the names of the cases in a folder.

    Raises
    ------
    InputError
        There is none.
    """
    experiments = folder.glob(f"*/*/{EXPERIMENT_FILE}")
    names = sorted({file.parents[1].name for file in experiments if not file.parents[1].name.startswith(".")})
    if not names:
        raise InputError(f"{folder}: holds no case; give a folder of folders of experiments")
    return names


def _in_turn(work: Callable[[str], str], names: Sequence[str]) -> Iterator[tuple[str, str]]:
    for name in names:
        yield name, work(name)


def _at_a_time(work: Callable[[str], str], names: Sequence[str], processes: int) -> Iterator[tuple[str, str]]:
    with worker_pool(processes) as pool:
        jobs = {pool.submit(work, name): name for name in names}
        for job in as_completed(jobs):
            yield jobs[job], job.result()


def _answer(diagnose: Diagnose, cases: Path, answers: Path, name: str) -> str:
    """Write the answer to a case; return why there is none, or nothing."""
    before = _processor_s()
    try:
        found = diagnose(read_case(cases / name), None)
    except EstimatorError as error:
        return str(error)
    target = _answer_file(answers, name)
    draft = target.with_name(f".{target.name}.partial")
    told = {
        **as_json(found),
        "ceiling": ceilings_as_json(ceilings(found.rivals)),
        "processor_seconds": round(_processor_s() - before, 2),
    }
    draft.write_text(json.dumps(told, indent=1), encoding="utf-8")
    draft.replace(target)
    return ""


def _processor_s() -> float:
    """Return the processor time of this process and of those that it has started and that have ended, s."""
    used = os.times()
    return used.user + used.system + used.children_user + used.children_system


def _answer_file(answers: Path, name: str) -> Path:
    return answers / f"{name}.json"
