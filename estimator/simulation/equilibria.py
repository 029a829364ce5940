"""The equilibria of a simulated case: under loads that move the gripper, and from a rest that may be under load."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.model.following import KnownField
from estimator.diagnosis.model.grip_load import GripLoad
from estimator.diagnosis.model.setup import Setup
from estimator.diagnosis.model.solution import KnownFields, Solution, reported_motion, solve_case
from estimator.errors import SolverError
from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.grip import wrench_of
from estimator.fem.equilibrium.newton import EquilibriumSolver, NewtonSettings
from estimator.fem.equilibrium.settling import grown
from estimator.fem.equilibrium.state import EquilibriumState
from estimator.forward.model import Progress
from estimator.simulation.truth import Truth

FloatArray = NDArray[np.float64]

# Where the motion depends on the load: a motion that changes by less than this, m or rad, has settled.
_SETTLED = 1e-6
_ROUNDS = 30
_RELAXATION = (0.1, 2.0)
_AT_REST = NewtonSettings(tolerance=1e-6, chord_rate=0.3)


def solve_truth(
    problem: RetractionProblem,
    planned: Sequence[Experiment],
    truth: Truth,
    progress: Progress | None = None,
) -> list[Solution]:
    """Solve a case until load and motion agree: a gripper that yields moves by the load that its motion makes.

    The loads are relaxed by Aitken's factor (Küttler & Wall 2008, Comput. Mech. 43, section 3.2.2).

    Raises
    ------
    SolverError
        The motion has no equilibrium, or does not settle under its own load.
    """

    def solve(loads: Sequence[GripLoad], known: KnownFields | None = None) -> list[Solution]:
        return solve_case(Setup(planned, problem, loads), truth, known, progress)

    felt = [np.zeros((len(experiment.time), 6)) for experiment in planned]
    nothing = [GripLoad(each, each) for each in felt]
    try:
        solutions = solve(nothing)
    except SolverError:
        at_rest = _field_at_rest(problem, planned[0], truth)
        solutions = solve(nothing, [[at_rest] * len(experiment.time) for experiment in planned])
    # What acts where nothing gives way: without load, no effect yields.
    unit_wrenches = [_wrench(solution) / truth.youngs_modulus for solution in solutions]
    last, share = np.zeros(0), 1.0
    for _ in range(_ROUNDS):
        wrenches = [_wrench(solution) for solution in solutions]
        if _motion_change(solutions, wrenches, truth, unit_wrenches) < _SETTLED:
            return solutions
        off = np.concatenate(wrenches) - np.concatenate(felt)
        if len(last):
            turn = off - last
            share = float(np.clip(-share * np.sum(last * turn) / np.sum(turn**2), *_RELAXATION))
        felt = [load + share * (wrench - load) for load, wrench in zip(felt, wrenches, strict=True)]
        known = [solution.known_fields() for solution in solutions]
        loads = [GripLoad(*each) for each in zip(felt, unit_wrenches, strict=True)]
        solutions = solve(loads, known)
        last = off
    raise SolverError(
        "the gripper's motion does not settle under the load that it makes; give slip or compliance a smaller value"
    )


def _wrench(solution: Solution) -> FloatArray:
    """Return the wrench (n, 6) of the tissue on the gripper by row, N and N·m."""
    problem = solution.problem
    by_visit = [wrench_of(problem, state) for state in solution.states]
    return np.array(by_visit)[solution.load_steps.of_row]


def _motion_change(
    solutions: Sequence[Solution],
    wrenches: Sequence[FloatArray],
    truth: Truth,
    unit_wrenches: Sequence[FloatArray],
) -> float:
    """Return by how much the true motion would change under the loads that it has made, m or rad."""
    change = 0.0
    for solution, wrench, unit_wrench in zip(solutions, wrenches, unit_wrenches, strict=True):
        first = np.searchsorted(solution.load_steps.of_row, np.arange(len(solution.load_steps)))
        load_steps = replace(solution.load_steps, load=wrench[first] - wrench[0])
        motion = truth.motion(reported_motion(load_steps, truth, unit_wrench))
        turn = (motion.rotation * solution.motion.rotation.inv()).magnitude()
        shift = np.abs(motion.position - solution.motion.position)
        change = max(change, float(np.max(shift)), float(np.max(turn)))
    return change


def _field_at_rest(problem: RetractionProblem, experiment: Experiment, truth: Truth) -> KnownField:
    """Follow the tissue at rest while what acts on it grows to its full size."""
    changed = truth.problem(problem)
    solver, material = EquilibriumSolver(changed, _AT_REST), truth.material()

    def under(share: float, near: EquilibriumState) -> EquilibriumState:
        terms = truth.weakened(share).terms(changed, experiment)
        partly = solver.under_weight(share)
        return partly.refine(near.pose, material, near.displacement, near.response.pressure, terms)

    state = grown(solver.rest(material, truth.terms(changed, experiment)), under)
    return KnownField(state.displacement, state.response.pressure)
