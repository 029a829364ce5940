"""The discretisation error of a hypothesis: its states on a finer mesh, with whatever acts on the tissue."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.load_steps import load_steps_of
from estimator.diagnosis.model.solution import Mechanics
from estimator.experiment import Experiment
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.newton import EquilibriumSolver
from estimator.fem.equilibrium.observation import observe
from estimator.fem.equilibrium.settling import settled
from estimator.fem.terms.rubbing import Rubs, carried_to
from estimator.fem.terms.term import Memoryless, Term
from estimator.forward.schedule import schedule_poses, spread_states
from estimator.inference.channels import predicted_channels
from estimator.inference.discretisation import NEWTON_ON_FINER_MESH, change_along, smooth

FloatArray = NDArray[np.float64]


def few_poses(experiment: Experiment, count: int) -> dict[int, GripperPose]:
    """Return the reported poses of a few states, spread over the motion, by the numbers of the states."""
    schedule = schedule_poses(experiment)
    return {state: schedule.poses[state] for state in spread_states(schedule, count)}


def load_steps_of_few(experiment: Experiment, count: int) -> list[int]:
    """Return load steps at the same poses."""
    state_of_row = schedule_poses(experiment).state_of_row
    of_row = load_steps_of(experiment, np.zeros((len(state_of_row), 6))).of_row
    return [int(of_row[int(np.argmax(state_of_row == state))]) for state in few_poses(experiment, count)]


def poses_at_rest_and_few(mechanics: Mechanics, count: int) -> dict[int, GripperPose]:
    """Return the true poses of a few states of a solved experiment by their numbers, that of its first row first."""
    solution = mechanics.solution
    schedule = schedule_poses(solution.load_steps.experiment)
    load_steps = {
        state: solution.load_steps.of_row[int(np.argmax(schedule.state_of_row == state))]
        for state in (0, *spread_states(schedule, count))
    }
    motion = solution.motion
    return {
        state: GripperPose(motion.position[load_step], motion.rotation[load_step])
        for state, load_step in load_steps.items()
    }


def channels_at(
    experiment: Experiment,
    hypothesis: Hypothesis,
    meshed: Callable[[Experiment], RetractionProblem],
    poses: Mapping[int, GripperPose],
) -> dict[int, FloatArray]:
    """Return the channels (c,), N, N·m and m, of states at their poses on a mesh, under all that does not remember.

    What rubs on what holds the tissue is part of how it is held: it slides from one of these poses to the next.

    Parameters
    ----------
    meshed : poses the retraction of the experiment on a mesh
    poses : by the numbers of the states, in the order in which they are solved

    Raises
    ------
    SolverError
        A pose has no equilibrium.
    """
    problem, material = hypothesis.problem(meshed(experiment)), hypothesis.material()
    acting = hypothesis.terms(problem, experiment)
    terms: tuple[Term, ...] = tuple(term for term in acting if isinstance(term, Memoryless | Rubs))
    solver = EquilibriumSolver(problem, NEWTON_ON_FINER_MESH)
    found, state = {}, settled(solver, material, terms)
    for number, pose in poses.items():
        state = solver.solve(pose, material, state, terms)
        carried = carried_to(pose.position, pose.rotation, terms)
        terms = tuple(term.after(state.displacement, state.response) for term in carried)
        if number == 0:
            problem = hypothesis.with_beads(problem, state.displacement)
        found[number] = predicted_channels(observe(problem, state))
    return found


def channels_met(mechanics: Mechanics, states: Iterable[int]) -> dict[int, FloatArray]:
    """Return the channels (c,) of states of a solved experiment, as :func:`channels_at` does."""
    load_steps = mechanics.solution.load_steps
    state_of_row = schedule_poses(load_steps.experiment).state_of_row
    return {
        state: predicted_channels(
            mechanics.observations[load_steps.of_row[int(np.argmax(state_of_row == state))]]
        )
        for state in states
    }


def correction_along(
    experiment: Experiment, coarse: Mapping[int, FloatArray], fine: Mapping[int, FloatArray]
) -> FloatArray:
    """Return the change (n, c) from the coarse mesh to the fine one, interpolated along the gripper's travel.

    ``coarse`` and ``fine`` are channels (c,) by the numbers of the states.
    """
    schedule = schedule_poses(experiment)
    change = {state: fine[state] - coarse[state] for state in fine}
    return change_along(schedule, change, smooth)[schedule.state_of_row]
