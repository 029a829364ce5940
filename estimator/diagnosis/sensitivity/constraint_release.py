"""Perturbations that set anchored nodes free: the solved states have no equations for these.

Each takes one Newton step of its own problem from every solved state, on the tissue condensed onto the nodes that any
of them sets free: one solution with the factor at hand for all, whatever the stretch and the springs that hold it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.solution import Passage
from estimator.diagnosis.model.term_history import TermChain
from estimator.diagnosis.sensitivity.linear_response import Station, linear_answers, stations
from estimator.diagnosis.sensitivity.perturbation import MechanicalChange, no_change
from estimator.fem.condensation import Condensed, condensed_onto
from estimator.fem.problem import RetractionProblem
from estimator.fem.terms import Term, summed_stiffness

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def changes_by_freeing(
    passages: Sequence[Passage], hypothesis: Hypothesis, freeing: Sequence[Hypothesis]
) -> list[list[MechanicalChange]]:
    """Return for each of the hypotheses ``freeing`` the change of every experiment.

    Parameters
    ----------
    passages : of every experiment, solved under ``hypothesis``
    freeing : each a small step away, to where nodes are free that the passages hold
    """
    solved = passages[0].problem
    problems = [to.problem(passages[0].baseline) for to in freeing]
    dofs = _dofs(solved.fixed & ~np.all([problem.fixed for problem in problems], axis=0))
    steps = [_freed(solved, problem, dofs) for problem in problems]
    rate_dependent = any(to.rate_dependent for to in freeing)
    own, chains = TermChain(hypothesis), [TermChain(to) for to in freeing]
    found: list[list[MechanicalChange]] = [[] for _ in freeing]
    for passage in passages:
        own.begin(solved, passage.visits.experiment)
        for chain, problem in zip(chains, problems, strict=True):
            chain.begin(problem, passage.visits.experiment)
        changes = _along(passage, stations(passage, rate_dependent), own, chains, steps, dofs)
        for one, change in zip(found, changes, strict=True):
            one.append(change)
    return found


def _along(
    passage: Passage,
    way: Sequence[Station],
    own: TermChain,
    chains: Sequence[TermChain],
    steps: Sequence[_Freed],
    dofs: IntArray,
) -> list[MechanicalChange]:
    """Return what each of the steps, with terms of its own, changes along one experiment."""
    changes = [no_change(passage) for _ in steps]
    steady = all(chain.steady for chain in (own, *chains))
    met: dict[int, int] = {}
    known: dict[int, Condensed] = {}
    for station in way:
        rows, state = station.rows, id(station.state)
        before = met.setdefault(state, rows.start)
        if steady and before != rows.start:
            for change in changes:
                change.wrench[rows] = change.wrench[before]
                change.fiducials[rows] = change.fiducials[before]
            continue
        terms = _passing(own, station)
        if state not in known or not own.steady:
            known[state] = condensed_onto(passage.problem, station.state, terms, dofs)
        for change, chain, step in zip(changes, chains, steps, strict=True):
            change.wrench[rows], change.fiducials[rows] = step.taken(
                passage.problem, station, known[state], terms, _passing(chain, station)
            )
    return changes


@dataclass(frozen=True)
class _Freed:
    """A problem that sets some of the condensed degrees of freedom free.

    Attributes
    ----------
    fixed : (n,) nodes that it holds
    dofs : (k,) degrees of freedom that it sets free
    which : (k,) their numbers among those that are condensed
    """

    fixed: NDArray[np.bool_]
    dofs: IntArray
    which: IntArray

    def taken(
        self,
        solved: RetractionProblem,
        station: Station,
        condensed: Condensed,
        before: tuple[Term, ...],
        after: tuple[Term, ...],
    ) -> tuple[FloatArray, FloatArray]:
        """Return the change of wrench (6,) and fiducials (m, 3) by one Newton step.

        ``before`` and ``after`` are the terms of the solved problem and of this one.
        """
        state = station.state
        load = _forces(after, station) - _forces(before, station)
        load[self.fixed] = 0.0
        if load.any():
            by_load = linear_answers(solved, state, load.reshape(-1, 1))
            wrench, fiducials = by_load[0][:, 0], by_load[1][:, :, 0]
        else:
            wrench, fiducials = np.zeros(6), np.zeros((len(solved.fiducials_rest), 3))
        force = (state.forces + load).reshape(-1)[self.dofs]
        force += condensed.follows[:, self.which].T @ load.reshape(-1)[solved.pattern.free]
        springs = _springs(after, station) - _springs(before, station)
        own = condensed.stiffness[np.ix_(self.which, self.which)]
        own += _block_diagonal(springs[self.dofs[::3] // 3])
        motion = -np.linalg.solve(own, force)
        return (
            wrench + condensed.wrench[:, self.which] @ motion,
            fiducials + condensed.fiducials[:, :, self.which] @ motion,
        )


def _freed(solved: RetractionProblem, problem: RetractionProblem, condensed: IntArray) -> _Freed:
    dofs = _dofs(solved.fixed & ~problem.fixed)
    return _Freed(problem.fixed, dofs, np.searchsorted(condensed, dofs))


def _dofs(nodes: NDArray[np.bool_]) -> IntArray:
    return np.flatnonzero(np.repeat(nodes, 3))


def _passing(chain: TermChain, station: Station) -> tuple[Term, ...]:
    """Return the terms at a station, and advance past it."""
    terms = chain.at(station.elapsed_s)
    chain.pass_by(station.state.displacement, station.state.response)
    return terms


def _forces(terms: tuple[Term, ...], station: Station) -> FloatArray:
    total = np.zeros_like(station.state.displacement)
    for term in terms:
        total += term.forces(station.state.displacement, station.state.response)
    return total


def _springs(terms: tuple[Term, ...], station: Station) -> FloatArray:
    """Return the stiffness (n, 3, 3) of the terms between nodes and their rest positions."""
    state = station.state
    nodes = summed_stiffness(terms, state.displacement, state.response).nodes
    return np.zeros((len(state.displacement), 3, 3)) if nodes is None else nodes


def _block_diagonal(blocks: FloatArray) -> FloatArray:
    """Return the matrix (3k, 3k) with blocks (k, 3, 3) on its diagonal."""
    count = len(blocks)
    whole = np.zeros((count, 3, count, 3))
    whole[np.arange(count), :, np.arange(count)] = blocks
    return whole.reshape(3 * count, 3 * count)
