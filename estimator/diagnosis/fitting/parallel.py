"""A case solved on several workers, one experiment each, so that none waits while a last refit goes on.

Where nothing remembers from one experiment to the next, each is solved by itself. Refits are threads that wait for
such solutions: of one refit alone, all experiments are solved at a time; of many, the workers always have one at hand.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from typing import TypeAlias

from estimator.diagnosis.fitting.case import Case, Linearisation, linearise, same_mechanics
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.term_history import TermHistory

# Returns the linearisation of a case at a hypothesis, from that of a solved neighbour if there is one.
Solve: TypeAlias = Callable[[Case, Hypothesis, Linearisation | None], Linearisation]


def solved_by(executor: Executor) -> Solve:
    """Return what solves a case on workers, and raises the SolverError of any experiment that has no equilibrium."""

    def solve(case: Case, hypothesis: Hypothesis, near: Linearisation | None) -> Linearisation:
        if not _each_by_itself(case, hypothesis, near):
            return executor.submit(linearise, case, hypothesis, near).result()
        jobs = [
            executor.submit(
                linearise, part, hypothesis, None if near is None else _of_experiment(near, number)
            )
            for number, part in enumerate(_parts(case))
        ]
        return _joined(case, _all_results(jobs))

    return solve


@contextmanager
def refits_at_a_time(count: int) -> Iterator[Executor]:
    """Give so many threads for refits, each of which waits for workers most of its time.

    Where the block is left early nobody waits for them: they end with their workers.
    """
    threads = ThreadPoolExecutor(max(count, 1), thread_name_prefix="refit")
    try:
        yield threads
    finally:
        threads.shutdown(wait=False, cancel_futures=True)


def _each_by_itself(case: Case, hypothesis: Hypothesis, near: Linearisation | None) -> bool:
    """Tell whether experiments may be solved apart: not where one goes on from what the one before has left.

    Where the tissue behaves as the neighbour's there is next to nothing to solve, and nothing is gained.
    """
    alike = near is not None and same_mechanics(near.hypothesis, hypothesis, case.settings.solver.near)
    return not alike and not _remembers(case, hypothesis)


def _remembers(case: Case, hypothesis: Hypothesis) -> bool:
    problem = hypothesis.problem(case.problem)
    return TermHistory.begun(hypothesis, problem, case.experiments[0]).remembers


def _parts(case: Case) -> list[Case]:
    whole = zip(case.experiments, case.corrections, case.whitenings, case.loads, strict=True)
    return [
        replace(case, experiments=(e,), corrections=(c,), whitenings=(w,), loads=(load,))
        for e, c, w, load in whole
    ]


def _of_experiment(fit: Linearisation, number: int) -> Linearisation:
    return replace(
        fit,
        predicted=(fit.predicted[number],),
        residual=(fit.residual[number],),
        jacobian=(fit.jacobian[number],),
        known=(fit.known[number],),
        mechanics=(fit.mechanics[number],),
    )


def _all_results(jobs: Sequence[Future[Linearisation]]) -> list[Linearisation]:
    try:
        return [job.result() for job in jobs]
    finally:
        for job in jobs:
            job.cancel()


def _joined(case: Case, parts: Sequence[Linearisation]) -> Linearisation:
    """Return the linearisation of all experiments, with one boundary value problem in common."""
    problem = parts[0].mechanics[0].solution.problem
    return replace(
        parts[0],
        predicted=tuple(part.predicted[0] for part in parts),
        residual=tuple(part.residual[0] for part in parts),
        jacobian=tuple(part.jacobian[0] for part in parts),
        known=tuple(part.known[0] for part in parts),
        mechanics=tuple(
            replace(one, solution=replace(one.solution, problem=problem, baseline=case.problem))
            for part in parts
            for one in part.mechanics
        ),
    )
