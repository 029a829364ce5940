"""Makes a set of cases, several at a time, going on where an earlier call stopped."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from threadpoolctl import threadpool_limits

from estimator.blind.making.case import Made, make_case, write_case
from estimator.blind.making.plan import Planned
from estimator.blind.sealing.commitment import commit
from estimator.errors import InputError, SolverError
from estimator.workers import Workers, run_each, worker_pool

Tell = Callable[[str, int, int], None]

KEY_SUFFIX = ".toml"


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
    workers: Workers = worker_pool,
    quick: bool = False,
    progress: Tell = lambda text, done, total: None,
) -> MadeSet:
    """Make a set of cases: folders in ``out``, answers in ``keys``, one file for each case.

    The same plan gives the same cases, whatever was interrupted and whoever worked. The set is committed to: each key
    has a random salt, and lists of hashes lie beside the cases and beside the keys.

    Parameters
    ----------
    cases : as :func:`~estimator.blind.making.plan.plan` chose them
    workers : that make a case each; by default one process a core
    quick : on a coarse mesh, for trials
    progress : hears a text, and how many of how many cases are done

    Raises
    ------
    InputError
        Keys would lie among the cases, or those that are there are not what was committed to.
    WorkersLostError
        The workers are gone; what is made is kept.
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
    for case, found in run_each(workers, partial(_make, quick=quick), to_make):
        if isinstance(found, Made):
            write_case(found, out / case.name, _key(keys, case))
            made.append(case.name)
        else:
            failed[case.name] = found
        progress(f"made {case.name}", len(there) + len(made) + len(failed), len(cases))
    set_hash = commit(out, keys).set_hash if made or there else ""
    return MadeSet(tuple(sorted(made)), tuple(case.name for case in there), failed, set_hash)


def _make(case: Planned, quick: bool) -> Made | str:
    """Return a case, or why there is none, with one thread in the linear algebra: others would sum otherwise."""
    try:
        with threadpool_limits(1):
            return make_case(case, quick)
    except SolverError as error:
        return str(error)


def _key(keys: Path, case: Planned) -> Path:
    return keys / f"{case.name}{KEY_SUFFIX}"
