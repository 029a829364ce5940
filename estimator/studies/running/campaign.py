"""Runs the cases of a study that are not known yet, and keeps each as soon as it is."""

from collections.abc import Callable, Sequence

from estimator.errors import StudyError, WorkersLostError
from estimator.studies.running.case import Case, Outcome, run_case
from estimator.studies.running.store import OutcomeStore
from estimator.workers import Workers, run_each

# Called with what is being done, how many of its cases are done, and how many there are.
Progress = Callable[[str, int, int], None]


def run_cases(
    cases: Sequence[Case], store: OutcomeStore, workers: Workers, progress: Progress
) -> list[Outcome]:
    """Return what became of every case, in their order.

    Parameters
    ----------
    cases : independent of each other
    store : where outcomes are looked for, and kept
    workers : starts where cases run; it is not called where all of them are known
    progress : told about every case

    Raises
    ------
    StudyError
        The workers are gone; what was done is kept.
    KeyboardInterrupt
        With a text that says so too.
    """
    known = {case.identity: outcome for case in cases if (outcome := store.read(case)) is not None}
    missing = {case.identity: case for case in cases if case.identity not in known}
    total = len(known) + len(missing)
    progress(f"{len(known)} of {total} cases are known", len(known), len(cases))
    try:
        for case, outcome in run_each(workers, run_case, list(missing.values())):
            known[case.identity] = outcome
            store.write(case, outcome)
            progress(f"done: {case.name}", len(known), total)
    except (KeyboardInterrupt, WorkersLostError) as stop:
        why = "interrupted" if isinstance(stop, KeyboardInterrupt) else str(stop)
        kept = (
            f"{why}: {len(known)} of {total} cases are kept in {store.folder}, "
            "and the same command goes on from there"
        )
        raise (StudyError if isinstance(stop, WorkersLostError) else type(stop))(kept) from None
    return [known[case.identity] for case in cases]
