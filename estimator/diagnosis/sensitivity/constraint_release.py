"""Perturbations that set held nodes free, or let them slide: the solved states have no equations for these.

Each takes one Newton step of its own problem from every solved state, on the tissue condensed onto the nodes that any
of them sets free: one solution with the factor at hand for all, whatever the stretch and the springs that hold it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.solution import Solution
from estimator.diagnosis.model.term_history import TermHistory
from estimator.diagnosis.sensitivity.linear_response import (
    TimePoint,
    check_solved_for,
    linear_response,
    time_points,
)
from estimator.diagnosis.sensitivity.perturbation import MechanicalChange, filled, no_change
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.condensation import Condensed, condensed_onto
from estimator.fem.terms.term import Term, summed_stiffness

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def changes_by_release(
    solutions: Sequence[Solution], hypothesis: Hypothesis, releasing: Sequence[Hypothesis]
) -> list[list[MechanicalChange]]:
    """Return for each of the hypotheses ``releasing`` the change of every experiment.

    Parameters
    ----------
    solutions : of every experiment, solved under ``hypothesis``
    releasing : each a small step away, to where nodes are free that the solutions hold
    """
    solved = solutions[0].problem
    problems = [to.problem(solutions[0].baseline) for to in releasing]
    dofs = _freed(solved, np.all([problem.held for problem in problems], axis=0))
    steps = [_release(solved, problem, dofs) for problem in problems]
    rate_dependent = any(to.rate_dependent for to in releasing)
    own, histories = TermHistory(hypothesis), [TermHistory(to) for to in releasing]
    found: list[list[MechanicalChange]] = [[] for _ in releasing]
    for solution in solutions:
        own.begin(solved, solution.load_steps.experiment)
        for history, problem in zip(histories, problems, strict=True):
            history.begin(problem, solution.load_steps.experiment)
        changes = _along(solution, time_points(solution, rate_dependent), own, histories, steps, dofs)
        for one, change in zip(found, changes, strict=True):
            one.append(change)
    return found


def _along(
    solution: Solution,
    way: Sequence[TimePoint],
    own: TermHistory,
    histories: Sequence[TermHistory],
    steps: Sequence[_Release],
    dofs: IntArray,
) -> list[MechanicalChange]:
    """Return what each of the steps, with terms of its own, changes along one experiment."""
    changes = [no_change(solution) for _ in steps]
    steady = all(history.steady for history in (own, *histories))
    check_solved_for(solution, steady)
    met: dict[int, int] = {}
    known: dict[int, Condensed] = {}
    for time_point in way:
        rows, state = time_point.rows, id(time_point.state)
        before = met.setdefault(state, rows.start)
        if steady and before != rows.start:
            for change in changes:
                change.wrench[rows] = change.wrench[before]
                change.fiducials[rows] = change.fiducials[before]
            continue
        terms = _passing(own, time_point)
        if state not in known or not own.steady:
            known[state] = condensed_onto(solution.problem, time_point.state, terms, dofs)
        for change, history, step in zip(changes, histories, steps, strict=True):
            change.wrench[rows], change.fiducials[rows] = step.taken(
                solution.problem, time_point, known[state], terms, _passing(history, time_point)
            )
    return [filled(solution, change) for change in changes]


@dataclass(frozen=True)
class _Release:
    """A problem that sets some of the condensed degrees of freedom free.

    Attributes
    ----------
    still : (n, 3) degrees of freedom that it and the solved problem hold, and that do not move
    dofs : (k,) degrees of freedom that it sets free
    which : (k,) their numbers among those that are condensed
    """

    still: NDArray[np.bool_]
    dofs: IntArray
    which: IntArray

    def taken(
        self,
        solved: RetractionProblem,
        time_point: TimePoint,
        condensed: Condensed,
        before: tuple[Term, ...],
        after: tuple[Term, ...],
    ) -> tuple[FloatArray, FloatArray]:
        """Return the change of wrench (6,) and fiducials (m, 3) by one Newton step.

        ``before`` and ``after`` are the terms of the solved problem and of this one.
        """
        state = time_point.state
        load = _forces(after, time_point) - _forces(before, time_point)
        load[self.still] = 0.0
        force = (state.forces + load).reshape(-1)[self.dofs]
        wrench, fiducials = np.zeros(6), np.zeros((len(solved.fiducials_rest), 3))
        if load.any():
            by_load = linear_response(solved, state, load.reshape(-1, 1))
            wrench, fiducials = by_load[0][:, 0], by_load[1][:, :, 0]
            force += condensed.follows[:, self.which].T @ load.reshape(-1)[solved.pattern.free]
        springs = _springs(after, time_point) - _springs(before, time_point)
        own = condensed.stiffness[np.ix_(self.which, self.which)]
        own += _between(springs, self.dofs)
        motion = -np.linalg.solve(own, force)
        if solved.grips_rigidly:  # what begins to slide on the gripper presses elsewhere
            moved = np.zeros(state.displacement.size)
            moved[self.dofs] = motion
            arms = moved.reshape(-1, 3)[solved.gripped]
            wrench[3:] -= np.cross(arms, state.forces[solved.gripped]).sum(axis=0)
        return (
            wrench + condensed.wrench[:, self.which] @ motion,
            fiducials + condensed.fiducials[:, :, self.which] @ motion,
        )


def _release(solved: RetractionProblem, problem: RetractionProblem, condensed: IntArray) -> _Release:
    dofs = _freed(solved, problem.held)
    still = problem.held.copy()
    still.reshape(-1)[solved.pattern.gripped] = False
    return _Release(still, dofs, np.searchsorted(condensed, dofs))


def _freed(solved: RetractionProblem, held: NDArray[np.bool_]) -> IntArray:
    """Return the degrees of freedom that a solved problem holds, and that are not among those held (n, 3)."""
    return np.flatnonzero(solved.held & ~held)


def _passing(history: TermHistory, time_point: TimePoint) -> tuple[Term, ...]:
    """Return the terms at a time_point, and advance past it."""
    terms = history.at(time_point.elapsed_s, time_point.state.pose)
    history.pass_by(time_point.state.displacement, time_point.state.response)
    return terms


def _forces(terms: tuple[Term, ...], time_point: TimePoint) -> FloatArray:
    total = np.zeros_like(time_point.state.displacement)
    for term in terms:
        total += term.forces(time_point.state.displacement, time_point.state.response)
    return total


def _springs(terms: tuple[Term, ...], time_point: TimePoint) -> FloatArray:
    """Return the stiffness (n, 3, 3) of the terms between nodes and their rest positions."""
    state = time_point.state
    nodes = summed_stiffness(terms, state.displacement, state.response).nodes
    return np.zeros((len(state.displacement), 3, 3)) if nodes is None else nodes


def _between(blocks: FloatArray, dofs: IntArray) -> FloatArray:
    """Return the matrix (k, k) of the nodes' blocks (n, 3, 3) at degrees of freedom (k,)."""
    node, axis = np.divmod(dofs, 3)
    entries = blocks[node[:, None], axis[:, None], axis]
    return np.where(node[:, None] == node, entries, 0.0)
