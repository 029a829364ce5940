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

from estimator.diagnosis.fitting.case import (
    Case,
    Foretold,
    Linearisation,
    compared,
    foretell,
    linearise,
    same_mechanics,
)
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.term_history import TermHistory

# Returns the linearisation of a case at a hypothesis, from that of a solved neighbour if there is one.
Solve: TypeAlias = Callable[[Case, Hypothesis, Linearisation | None], Linearisation]


def solved_by(executor: Executor) -> Solve:
    """Return what solves a case on workers, and raises the SolverError of any experiment that has no equilibrium."""

    def solve(case: Case, hypothesis: Hypothesis, near: Linearisation | None) -> Linearisation:
        if near is not None and same_mechanics(near.hypothesis, hypothesis, case.settings.solver.near):
            return linearise(case, hypothesis, near)
        # What was measured, and its noise, stays here: it is several times what the tissue takes to be sent.
        unmeasured = replace(case, whitenings=())
        begun = None if near is None else _fields_alone(near)
        if _carries_over(case, hypothesis):
            foretold = executor.submit(foretell, unmeasured, hypothesis, begun).result()
        else:
            parts = _parts(unmeasured)
            jobs = [
                executor.submit(foretell, part, hypothesis, start)
                for part, start in zip(parts, _of_each(begun, len(parts)), strict=True)
            ]
            foretold = _joined(case, _all_results(jobs))
        return compared(case, foretold)

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


def _carries_over(case: Case, hypothesis: Hypothesis) -> bool:
    problem = hypothesis.problem(case.problem)
    return TermHistory.begun(hypothesis, problem, case.experiments[0]).carries_over


def _fields_alone(near: Linearisation) -> Linearisation:
    """Return of a neighbour what another hypothesis begins from."""
    return replace(near, predicted=(), residual=(), jacobian=(), mechanics=())


def _of_each(begun: Linearisation | None, count: int) -> list[Linearisation | None]:
    """Return a neighbour's fields for each of so many experiments."""
    return [None] * count if begun is None else [replace(begun, known=(known,)) for known in begun.known]


def _parts(case: Case) -> list[Case]:
    whole = zip(case.experiments, case.corrections, case.loads, strict=True)
    return [replace(case, experiments=(e,), corrections=(c,), loads=(load,)) for e, c, load in whole]


def _all_results(jobs: Sequence[Future[Foretold]]) -> list[Foretold]:
    try:
        return [job.result() for job in jobs]
    finally:
        for job in jobs:
            job.cancel()


def _joined(case: Case, parts: Sequence[Foretold]) -> Foretold:
    """Return what is foretold of all experiments, with one boundary value problem in common."""
    problem = parts[0].mechanics[0].solution.problem
    return replace(
        parts[0],
        predicted=tuple(part.predicted[0] for part in parts),
        slopes=tuple(part.slopes[0] for part in parts),
        known=tuple(part.known[0] for part in parts),
        mechanics=tuple(
            replace(one, solution=replace(one.solution, problem=problem, baseline=case.problem))
            for part in parts
            for one in part.mechanics
        ),
    )
