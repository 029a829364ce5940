"""The cases in a folder, one after another or several at a time, going on where an earlier call stopped."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeAlias

from estimator.errors import EstimatorError, InputError
from estimator.experiment import Experiment, read_case
from estimator.experiment.model import EXPERIMENT_FILE
from estimator.workers import Workers, run_each

Tell: TypeAlias = Callable[[str, int, int], None]
# Makes texts of the name and the experiments of a case; may raise any EstimatorError.
Task: TypeAlias = Callable[[str, Sequence[Experiment]], Sequence[str]]


@dataclass(frozen=True, slots=True)
class Batch:
    """What a call did: names of the cases done, of those that had been, and what failed, by name."""

    done: tuple[str, ...]
    present: tuple[str, ...]
    failed: dict[str, str]


@dataclass(frozen=True, slots=True)
class _NamedCase:
    name: str
    experiments: tuple[Experiment, ...]


def run_batch(
    task: Task,
    cases: Path,
    files: Callable[[str], Sequence[Path]],
    *,
    workers: Workers | None = None,
    progress: Tell = lambda text, done, total: None,
) -> Batch:
    """Carry out a task on every case in a folder that it was not carried out on yet.

    Of a case, only its experiments are read, and they are read here: workers need not see the folder.

    Parameters
    ----------
    task : on the name and the experiments of a case; a function at the top of a module, which other processes can find
    cases : folder of cases, each a folder of experiments
    files : the files for a case's texts, by its name; the last one, which appears whole, tells that the case is done
    workers : that take a case each; by default the cases are done in turn, in this process
    progress : hears a text, and how many of how many cases are done

    Raises
    ------
    InputError
        The folder holds no case, or one that cannot be read; nothing is done or written then.
    WorkersLostError
        The workers are gone; what is done is kept.
    """
    names = case_names(cases)
    present = tuple(name for name in names if files(name)[-1].exists())
    # what cannot be read is told before hours of work, not after
    missing = [_NamedCase(name, tuple(read_case(cases / name))) for name in names if name not in present]
    done: list[str] = []
    failed: dict[str, str] = {}
    progress("diagnosing cases", len(present), len(names))
    work = partial(_attempt, task)
    found = _in_turn(work, missing) if workers is None else run_each(workers, work, missing)
    for case, (texts, failure) in found:
        if failure:
            failed[case.name] = failure
        else:
            _write(texts, files(case.name))
            done.append(case.name)
        progress(f"diagnosed {case.name}", len(present) + len(done) + len(failed), len(names))
    return Batch(tuple(sorted(done)), present, failed)


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


def _in_turn(
    work: Callable[[_NamedCase], tuple[Sequence[str], str]], cases: Sequence[_NamedCase]
) -> Iterator[tuple[_NamedCase, tuple[Sequence[str], str]]]:
    for case in cases:
        yield case, work(case)


def _attempt(task: Task, case: _NamedCase) -> tuple[Sequence[str], str]:
    """Return the texts that a task makes of a case, or why there are none."""
    try:
        return task(case.name, case.experiments), ""
    except EstimatorError as error:
        return (), str(error)


def _write(texts: Sequence[str], files: Sequence[Path]) -> None:
    for text, file in zip(texts, files, strict=True):
        file.parent.mkdir(parents=True, exist_ok=True)
        draft = file.with_name(f".{file.name}.partial")
        draft.write_text(text, encoding="utf-8")
        draft.replace(file)
