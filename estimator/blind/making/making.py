"""Makes a set of cases, several at a time, going on where an earlier call stopped."""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from estimator.blind.making.case import make_case, write_case
from estimator.blind.making.plan import Planned
from estimator.blind.sealing.commitment import commit
from estimator.errors import InputError, SolverError
from estimator.workers import worker_pool

Tell = Callable[[str, int, int], None]

KEY_SUFFIX = ".toml"
_THREAD_LIMITS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True, slots=True)
class MadeSet:
    """What a call did.

    Attributes
    ----------
    made, present : names of the cases made, and of those that were there
    failed : why others were not made, by name
    set_hash : what the whole set is committed to; empty where it holds no case
    """

    made: tuple[str, ...]
    present: tuple[str, ...]
    failed: dict[str, str]
    set_hash: str = ""


def make_cases(
    cases: Sequence[Planned],
    out: Path,
    keys: Path,
    *,
    processes: int | None = None,
    quick: bool = False,
    progress: Tell = lambda text, done, total: None,
) -> MadeSet:
    """Make a set of cases: folders in ``out``, answers in ``keys``, one file for each case.

    The same plan gives the same cases, whatever was interrupted and however many processes worked. The set is committed
    to: each key has a random salt, and lists of hashes lie beside the cases and beside the keys.

    Parameters
    ----------
    cases : as :func:`~estimator.blind.making.plan.plan` chose them
    processes : at a time; by default one a core
    quick : on a coarse mesh, for trials
    progress : hears a text, and how many of how many cases are done

    Raises
    ------
    InputError
        Keys would lie among the cases, or those that are there are not what was committed to.
    """
    if keys.resolve() == out.resolve() or out.resolve() in keys.resolve().parents:
        raise InputError(f"{keys}: answers would lie among the cases in {out}; give another folder")
    there = [case for case in cases if (out / case.name).exists() and _key(keys, case).exists()]
    to_make = [case for case in cases if case not in there]
    out.mkdir(parents=True, exist_ok=True)
    keys.mkdir(parents=True, exist_ok=True)
    made: list[str] = []
    failed: dict[str, str] = {}
    progress("making cases", len(there), len(cases))
    work = partial(_make, out=out, keys=keys, quick=quick)
    workers = min(processes or os.cpu_count() or 1, max(len(to_make), 1))
    with _one_thread_each(), worker_pool(workers) as pool:
        for future in as_completed([pool.submit(work, case) for case in to_make]):
            name, failure = future.result()
            if failure:
                failed[name] = failure
            else:
                made.append(name)
            progress(f"made {name}", len(there) + len(made) + len(failed), len(cases))
    set_hash = commit(out, keys).set_hash if made or there else ""
    return MadeSet(tuple(sorted(made)), tuple(case.name for case in there), failed, set_hash)


def _make(case: Planned, out: Path, keys: Path, quick: bool) -> tuple[str, str]:
    try:
        write_case(make_case(case, quick), out / case.name, _key(keys, case))
    except SolverError as error:
        return case.name, str(error)
    return case.name, ""


def _key(keys: Path, case: Planned) -> Path:
    return keys / f"{case.name}{KEY_SUFFIX}"


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Let every process started meanwhile compute in one thread."""
    before = {name: os.environ.get(name) for name in _THREAD_LIMITS}
    os.environ.update(dict.fromkeys(_THREAD_LIMITS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
