"""The learnt map beside simulations that it was not learnt from, for chosen causes alone."""

from collections.abc import Sequence

from estimator.errors import InputError
from estimator.studies.published_gap.candidate import Candidate
from estimator.studies.published_gap.candidates import CANDIDATES
from estimator.studies.published_gap.learning import Check, ResponseMap
from estimator.studies.published_gap.paper_estimator import LOW_DENSITY_CELLS
from estimator.studies.published_gap.retractions import SetUp
from estimator.studies.published_gap.simulations import learning_cases, pair_cases
from estimator.studies.running.campaign import Progress, run_cases
from estimator.studies.running.case import Case
from estimator.studies.running.store import OutcomeStore
from estimator.workers import Workers

Causes = tuple[Candidate, ...]


def causes_named(names: Sequence[str], candidates: Sequence[Candidate] = CANDIDATES) -> list[Causes]:
    """Return the causes of names such as ``gripper_slip`` and ``gripper_slip+stiffening``.

    Raises
    ------
    InputError
        A name is no cause that a retraction is simulated with, or names other than one or two of them.
    """
    known = {one.name: one for one in candidates if one.effect}
    found = []
    for name in names:
        parts = [part.strip() for part in name.split("+")]
        if odd := [part for part in parts if part not in known]:
            raise InputError(
                f"'{odd[0]}' is no cause that is simulated; name one or A+B of {', '.join(known)}"
            )
        if len(parts) > 2 or len(set(parts)) < len(parts):
            raise InputError(f"'{name}' is neither one cause nor two; name one, or two as A+B")
        found.append(tuple(known[part] for part in parts))
    return found


def check_map(
    set_up: SetUp,
    chosen: Sequence[Causes],
    store: OutcomeStore,
    workers: Workers,
    progress: Progress,
    cells: tuple[int, int, int] = LOW_DENSITY_CELLS,
) -> list[Check]:
    """Learn the map of chosen causes, and hold it against further simulations; what is stored is not done again.

    Parameters
    ----------
    set_up : of the retractions
    chosen : a cause alone is checked at each of its ``checks``, two together at the first of each
    store, workers, progress : where outcomes are kept, who computes them, what hears of it
    cells : of the estimator's mesh

    Raises
    ------
    StudyError
        A simulation failed without which nothing can be learnt, or a worker died.
    """
    candidates = list(dict.fromkeys(one for causes in chosen for one in causes))
    pairs = [causes for causes in chosen if len(causes) > 1]
    at = [[one.checks[0] for one in pair] for pair in pairs]
    together = [pair_cases(set_up, pair, sizes) for pair, sizes in zip(pairs, at, strict=True)]
    cases: list[Case] = [
        *learning_cases(set_up, candidates, cells),
        *(one for both in together for one in both),
    ]
    outcomes = run_cases(cases, store, workers, progress)
    known = {case.identity: outcome for case, outcome in zip(cases, outcomes, strict=True)}
    response = ResponseMap(set_up, candidates, known, cells=cells)
    found = [check for causes in chosen if len(causes) == 1 for check in response.checks(causes[0])]
    for pair, sizes, both in zip(pairs, at, together, strict=True):
        check = response.pair_check(pair, sizes, [known[case.identity] for case in both])
        found += [] if check is None else [check]
    return found
