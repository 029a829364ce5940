"""Runs the cases of a study that are not known yet, and keeps each as soon as it is."""

from collections.abc import Callable, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, as_completed
from contextlib import AbstractContextManager

from estimator.errors import StudyError
from estimator.studies.running.case import Case, Outcome, run_case
from estimator.studies.running.store import OutcomeStore

# Called with what is being done, how many of its cases are done, and how many there are.
Progress = Callable[[str, int, int], None]


def run_cases(
    cases: Sequence[Case],
    store: OutcomeStore,
    executor: Callable[[], AbstractContextManager[Executor]],
    progress: Progress,
) -> list[Outcome]:
    """Return what became of every case, in their order.

    Parameters
    ----------
    cases : independent of each other
    store : where outcomes are looked for, and kept
    executor : starts where cases run; it is not called where all of them are known
    progress : told about every case

    Raises
    ------
    StudyError
        A worker died; what was done is kept.
    KeyboardInterrupt
        With a text that says so too.
    """
    known = {case.identity: outcome for case in cases if (outcome := store.read(case)) is not None}
    missing = {case.identity: case for case in cases if case.identity not in known}
    progress(f"{len(known)} of {len(known) + len(missing)} cases are known", len(known), len(cases))
    if missing:
        with executor() as workers:
            _run(list(missing.values()), store, workers, progress, known)
    return [known[case.identity] for case in cases]


def _run(
    cases: Sequence[Case],
    store: OutcomeStore,
    workers: Executor,
    progress: Progress,
    known: dict[str, Outcome],
) -> None:
    """Run the cases and add them to those that are known."""
    total = len(known) + len(cases)
    running: dict[Future[Outcome], Case] = {workers.submit(run_case, case): case for case in cases}

    def keep(future: Future[Outcome]) -> Case:
        case = running[future]
        if case.identity not in known:
            known[case.identity] = outcome = future.result()
            store.write(case, outcome)
        return case

    try:
        for future in as_completed(running):
            progress(f"done: {keep(future).name}", len(known), total)
    except (KeyboardInterrupt, BrokenExecutor) as stop:
        for future in running:
            if not future.cancel() and future.done() and future.exception() is None:
                keep(future)
        if isinstance(stop, BrokenExecutor):
            raise StudyError(_stopped(f"a worker died ({stop})", known, total, store)) from stop
        raise type(stop)(_stopped("interrupted", known, total, store)) from None


def _stopped(why: str, known: dict[str, Outcome], total: int, store: OutcomeStore) -> str:
    return f"{why}: {len(known)} of {total} cases are kept in {store.folder}, and the same command goes on from there"
