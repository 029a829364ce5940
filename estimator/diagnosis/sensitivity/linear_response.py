"""What a change of the nodal forces does to a solved experiment: the changed loads, and the response to them.

Many perturbations go along a solution together. What does not depend on them, the forces of the hypothesis' own terms
and the back-substitution's start, is done once for all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.solution import Mechanics, Solution, displacement_at_rest
from estimator.diagnosis.model.term_history import TermForces, TermHistory
from estimator.diagnosis.sensitivity.perturbation import MechanicalChange, Perturbation, filled, no_change
from estimator.experiment import Experiment
from estimator.fem.assembly.body import Response, nodal_forces, respond, respond_alike
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.grip import wrench_by_forces, wrench_of
from estimator.fem.equilibrium.observation import interpolate
from estimator.fem.equilibrium.rubbing import following, handed_on
from estimator.fem.equilibrium.state import EquilibriumState

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class TimePoint:
    """A time at which the terms are evaluated: a load step, or a row of it where the tissue changes at rest."""

    state: EquilibriumState
    elapsed_s: float
    rows: slice


def time_points(solution: Solution, rate_dependent: bool) -> list[TimePoint]:
    """Return every row of a solution where the tissue changes at rest, else every load step that is solved."""
    load_steps = solution.load_steps
    if rate_dependent and solution.between is None:
        times, starts = load_steps.experiment.time, np.arange(len(load_steps.of_row))
        states = [solution.states[load_step] for load_step in load_steps.of_row]
    else:
        times, starts = load_steps.time, np.searchsorted(load_steps.of_row, np.arange(len(load_steps)))
        states = list(solution.states)
    elapsed, ends = np.diff(times, prepend=times[0]), np.append(starts[1:], len(load_steps.of_row))
    which = np.arange(len(starts)) if solution.between is None else solution.solved
    return [
        TimePoint(state, float(elapsed[n]), slice(int(starts[n]), int(ends[n])))
        for n, state in zip(which, states, strict=True)
    ]


def check_solved_for(solution: Solution, steady: bool) -> None:
    """Refuse to go from one time point to the next where load steps between them are not solved.

    Raises
    ------
    ValueError
        A perturbation remembers or has its time, and not every load step is solved.
    """
    if solution.between is not None and not steady:
        raise ValueError("what remembers is to be followed along a solution of every load step")


@dataclass(frozen=True)
class _Moved:
    """What a perturbation asks for at a solved field.

    Attributes
    ----------
    displacement : (n, 3) with the grip of the changed problem, m
    response : of the changed tissue
    load : (n, 3) change of the nodal forces, N
    rubbing : (n, 3) what of that is of terms that rub on what holds the tissue, N
    """

    displacement: FloatArray
    response: Response
    load: FloatArray
    rubbing: FloatArray


class _Loading:
    """A perturbation on its way along the solutions."""

    def __init__(self, hypothesis: Hypothesis, perturbation: Perturbation, solution: Solution) -> None:
        effect, to = perturbation.effect, perturbation.to
        new_problem = effect is not None and "problem" in effect.acts_on
        self.places_beads = any("beads" in present.acts_on for present in to.effects)
        anew = new_problem or self.places_beads or (effect is not None and to.rest_misread_by(effect))
        self.problem = to.problem(solution.baseline) if anew else solution.problem
        # Of a problem whose body and grip are the same, anchors alone hold otherwise: the tissue's own stress stays.
        self._new_shape = new_problem and not _is_gripped_alike(self.problem, solution.problem)
        self._same_deformation = self.problem.body is solution.problem.body and not self._new_shape
        self._new_response = effect is None or "material" in effect.acts_on or self._new_shape
        self.terms_matter = bool(hypothesis.effects) or (effect is not None and "terms" in effect.acts_on)
        self.matters = anew or self._new_response or self.terms_matter
        self.rate_dependent = to.rate_dependent
        self._to = to
        self._material = to.material()
        self._heavier = self.problem.weight - solution.problem.weight
        self._terms = TermHistory(to)

    def begin(self, experiment: Experiment) -> None:
        self._terms.begin(self.problem, experiment)

    def put_beads(self, at_rest: FloatArray) -> None:
        """Put the beads where they sit on tissue of which the nodes (n, 3) are displaced, m, at rest."""
        self.problem = self._to.with_beads(self.problem, at_rest)

    @property
    def steady(self) -> bool:
        """Whether the load at a state that is met again is what it was."""
        return self._terms.steady

    def pass_by(self, displacement: FloatArray, response: Response) -> None:
        """Advance what remembers past a time_point with its displacement (n, 3)."""
        if self.terms_matter:
            self._terms.pass_by(displacement, response)

    def response_to(self, displacement: FloatArray) -> Response:
        """Return how the changed tissue responds to displacements (n, 3)."""
        return respond(self.problem.body, self._material, displacement)

    def _response_at(self, state: EquilibriumState, displacement: FloatArray) -> Response:
        """Return the same at a state's displacements (n, 3), from its own response where but E and ν differ."""
        law, shape = self._material.law, self._material.shape
        alike = law is state.material.law and np.array_equal(shape, state.material.shape)
        known = state.response if alike and self._same_deformation else self.response_to(displacement)
        return respond_alike(self.problem.body, self._material, known)

    def at(self, time_point: TimePoint, unperturbed: FloatArray, of_terms: TermForces | None) -> _Moved:
        """Return what the changed problem asks for at the unchanged field.

        Parameters
        ----------
        unperturbed : (n, 3) nodal forces of the tissue's own stress
        of_terms : those of the hypothesis' terms; None where no perturbation asks for them
        """
        displacement, response = time_point.state.displacement, time_point.state.response
        load, rubbing = np.zeros_like(displacement), np.zeros_like(displacement)
        if self._new_shape:
            displacement = self.problem.imposed(displacement, time_point.state.pose)
        if self._new_response:
            response = self._response_at(time_point.state, displacement)
            load += nodal_forces(self.problem.body, response, response.slope) - unperturbed
            load -= self._heavier
        if self.terms_matter and of_terms is not None:
            pose = time_point.state.pose
            changed = self._terms.forces(time_point.elapsed_s, pose, displacement, response)
            load += changed.total - of_terms.total
            rubbing += changed.rubbing - of_terms.rubbing
        return _Moved(displacement, response, load, rubbing)


def _is_gripped_alike(one: RetractionProblem, other: RetractionProblem) -> bool:
    return one.body is other.body and np.array_equal(one.grasp_centre, other.grasp_centre)


def changes_by_loads(
    mechanics: Sequence[Mechanics], hypothesis: Hypothesis, perturbations: Sequence[Perturbation]
) -> list[list[MechanicalChange]]:
    """Return for each perturbation the change of every experiment by the change of its nodal forces."""
    first = mechanics[0].solution
    loadings = [_Loading(hypothesis, perturbation, first) for perturbation in perturbations]
    found: list[list[MechanicalChange]] = [[no_change(m.solution) for m in mechanics] for _ in loadings]
    for rate_dependent in (False, True):
        chosen = [n for n, one in enumerate(loadings) if one.matters and one.rate_dependent == rate_dependent]
        if chosen:
            changes = _along_solutions(
                [one.solution for one in mechanics], hypothesis, [loadings[n] for n in chosen], rate_dependent
            )
            for n, change in zip(chosen, changes, strict=True):
                found[n] = change
    return found


def _along_solutions(
    solutions: Sequence[Solution], hypothesis: Hypothesis, loadings: Sequence[_Loading], rate_dependent: bool
) -> list[list[MechanicalChange]]:
    own_terms = TermHistory(hypothesis) if any(one.terms_matter for one in loadings) else None
    found: list[list[MechanicalChange]] = [[] for _ in loadings]
    without_beads = [k for k, loading in enumerate(loadings) if loading.places_beads]
    for solution in solutions:
        changes = [no_change(solution) for _ in loadings]
        if own_terms is not None:
            own_terms.begin(solution.problem, solution.load_steps.experiment)
        for loading in loadings:
            loading.begin(solution.load_steps.experiment)
        # Where nothing remembers yet, how the fields change counts to second order alone.
        remembers = own_terms is not None and own_terms.remembers
        everything = list(range(len(loadings)))
        own_terms_steady = own_terms is None or own_terms.steady
        unsteady = [k for k in everything if not (own_terms_steady and loadings[k].steady)]
        check_solved_for(solution, not unsteady)
        answered: dict[int, int] = {}
        for time_point in time_points(solution, rate_dependent):
            state = time_point.state
            met_at = answered.get(id(state))
            if met_at is None:
                answered[id(state)] = time_point.rows.start
                asked = everything
            else:
                asked = unsteady
                for change in changes:
                    change.wrench[time_point.rows] = change.wrench[met_at]
                    change.fiducials[time_point.rows] = change.fiducials[met_at]
            if not asked:
                continue
            unperturbed = nodal_forces(solution.problem.body, state.response, state.response.slope)
            of_terms = None
            if own_terms is not None:
                of_terms = own_terms.forces(
                    time_point.elapsed_s, state.pose, state.displacement, state.response
                )
                own_terms.pass_by(state.displacement, state.response)
            moved = [loadings[k].at(time_point, unperturbed, of_terms) for k in asked]
            loads = np.column_stack([one.load.ravel() for one in moved])
            rubbing = np.column_stack([one.rubbing.ravel() for one in moved])
            motion = linear_motion(solution.problem, state, loads)
            motions = motion.T.reshape(len(asked), -1, 3)
            if without_beads:
                at_rest = displacement_at_rest(solution)
                for k in without_beads:
                    loadings[k].put_beads(at_rest + motions[k])
                without_beads = []
            wrenches, fiducials = response_to(solution.problem, state, loads, motion, rubbing)
            for column, (k, asking) in enumerate(zip(asked, moved, strict=True)):
                loading, displacement, response = loadings[k], asking.displacement, asking.response
                if remembers:
                    changed = displacement + motions[column]
                    loading.pass_by(changed, loading.response_to(changed))
                else:
                    loading.pass_by(displacement, response)
                by_wrench, by_beads = _of_the_grip(solution.problem, loading.problem, state, displacement)
                changes[k].wrench[time_point.rows] = wrenches[:, column] + by_wrench
                changes[k].fiducials[time_point.rows] = fiducials[:, :, column] + by_beads
        for one, change in zip(found, changes, strict=True):
            one.append(filled(solution, change))
    return found


def _of_the_grip(
    problem: RetractionProblem,
    changed: RetractionProblem,
    state: EquilibriumState,
    displacement: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return what a changed problem does to wrench (6,) and fiducials (m, 3) at the same nodal forces."""
    if changed is problem:
        return np.zeros(6), np.zeros((len(problem.fiducials_rest), 3))
    wrench = wrench_of(changed, state) - wrench_of(problem, state)
    before = problem.fiducial_positions(state.displacement, state.pose)
    return wrench, changed.fiducial_positions(displacement, state.pose) - before


def linear_response(
    problem: RetractionProblem, state: EquilibriumState, loads: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the changes of wrench (6, k) and fiducials (m, 3, k) by changes of the tissue's nodal forces (3n, k).

    What rubs on what holds the tissue follows them.
    """
    rubbing = following(state, loads)
    loads = loads + rubbing
    return response_to(problem, state, loads, linear_motion(problem, state, loads), rubbing)


def response_to(
    problem: RetractionProblem,
    state: EquilibriumState,
    loads: FloatArray,
    motion: FloatArray,
    rubbing: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return the same where the changes of the nodal displacements (3n, k) are known already.

    ``rubbing`` (3n, k) is what of the loads rubs on what holds the tissue.
    """
    by_motion = state.tangent.gripped_free @ motion[problem.pattern.free]
    rubbed = handed_on(problem, state, motion, by_motion, rubbing)
    held = loads[problem.pattern.gripped] + by_motion
    return wrench_by_forces(problem, state, held, motion, rubbed), interpolate(problem, motion)


def linear_motion(problem: RetractionProblem, state: EquilibriumState, loads: FloatArray) -> FloatArray:
    """Return the changes of the nodal displacements (3n, k) by changes of the nodal forces (3n, k)."""
    free = problem.pattern.free
    motion = np.zeros(loads.shape)
    motion[free] = -state.tangent.free.solve(loads[free])
    return motion
