"""A case solved under a hypothesis: the equilibria of every experiment, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.model.between import (
    Between,
    fields_between,
    kinks,
    observations_between,
    spread_between,
)
from estimator.diagnosis.model.following import Follower, KnownField, Path
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.load_steps import LoadSteps, load_steps_of, rows_as_load_steps
from estimator.diagnosis.model.setup import Setup
from estimator.diagnosis.model.term_history import TermHistory
from estimator.effects.effect import Motion
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.observation import Observation, observe
from estimator.fem.equilibrium.state import EquilibriumState, linear_change
from estimator.inference.extrapolation import extrapolated
from estimator.inference.material_parameters import POISSON_RATIO, YOUNGS_MODULUS

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Progress = Callable[[int, int], None]


# For each experiment, by row, the field of the load step that the row belongs to.
KnownFields = Sequence[Sequence[KnownField]]


@dataclass(frozen=True)
class Solution:
    """One experiment solved under a hypothesis.

    Attributes
    ----------
    load_steps : LoadSteps
    unit_wrench : (n, 6) of the baseline by row, per unit of Young's modulus
    motion : true motion of the gripper at the load steps
    problem, baseline : the boundary value problem that was solved, and the one without any effect
    states : of every load step, or of those that are solved
    between : where the others lie between these; None where every load step is solved
    """

    load_steps: LoadSteps
    unit_wrench: FloatArray
    motion: Motion
    problem: RetractionProblem
    baseline: RetractionProblem
    states: tuple[EquilibriumState, ...]
    between: Between | None = None

    @property
    def solved(self) -> IntArray:
        """The load steps that the states are of, ascending."""
        return np.arange(len(self.load_steps)) if self.between is None else self.between.solved

    @property
    def distinct_states(self) -> list[EquilibriumState]:
        """The states without those that are met again."""
        return list({id(state): state for state in self.states}.values())

    def filled(self, values: FloatArray) -> FloatArray:
        """Return values (v, ...) at all load steps from those (s, ...) at the solved ones."""
        return values if self.between is None else self.between.filled(values)

    def known_fields(self) -> list[KnownField]:
        """Return the fields by row."""
        solved = zip(self.solved.tolist(), self.states, strict=True)
        fields = {step: KnownField(state.displacement, state.response.pressure) for step, state in solved}
        visits = self.solved
        if self.between is not None:
            between = fields_between(self.problem, self.between, self.states)
            fields |= {step: KnownField(*field) for step, field in between.items()}
            visits = self.between.visits[self.between.place]
        return [fields[step] for step in visits[self.load_steps.of_row].tolist()]


@dataclass(frozen=True)
class Mechanics:
    """The observables of one solved experiment before any sensor, with their derivatives, load step by load step."""

    solution: Solution
    observations: tuple[Observation, ...]

    @property
    def wrench(self) -> FloatArray:
        """Return the wrench at every load step, (v, 6)."""
        return np.array([o.wrench for o in self.observations])

    @property
    def fiducials(self) -> FloatArray:
        """Return the fiducials at every load step, (v, m, 3)."""
        return np.array([o.fiducials for o in self.observations])

    def without_states(self) -> Mechanics:
        """Return the observables alone, which is less to keep and can go to another process."""
        light = tuple(replace(observation, field_by={}) for observation in self.observations)
        return Mechanics(replace(self.solution, states=(), between=None), light)

    def at(self, before: Hypothesis, after: Hypothesis) -> Mechanics:
        """Extrapolate the observables of the baseline to another E and ν nearby."""
        moved = tuple(
            extrapolated(one, (YOUNGS_MODULUS, POISSON_RATIO), before.of_material, after.of_material)
            for one in self.observations
        )
        return Mechanics(self.solution, moved)


def mechanics_of(solution: Solution) -> Mechanics:
    """Evaluate the observables of every load step."""
    of_state = {id(state): observe(solution.problem, state) for state in solution.distinct_states}
    observed = tuple(of_state[id(state)] for state in solution.states)
    if solution.between is not None:
        observed = observations_between(solution.between, observed)
    return Mechanics(solution, observed)


def at_few_poses(mechanics: Mechanics, every: int, smooth_m: float) -> Mechanics:
    """Return the mechanics of tissue that remembers nothing with the states at every so many poses alone.

    A state that its neighbours foretell worse than by ``smooth_m`` is at a kink: those around it are kept.
    """
    solution = mechanics.solution
    between = spread_between(solution.motion, every) if solution.between is None else None
    if between is None:
        return mechanics
    states = [solution.states[step] for step in between.solved]
    bent = kinks(between, states, solution.problem.pattern.free, smooth_m)
    between = between.with_solved(between.around(bent))
    few = tuple(solution.states[step] for step in between.solved)
    return replace(mechanics, solution=replace(solution, states=few, between=between))


def solve_case(
    setup: Setup,
    hypothesis: Hypothesis,
    known: KnownFields | None = None,
    progress: Progress | None = None,
    *,
    every: int = 1,
    besides: Sequence[Collection[int]] = (),
) -> list[Solution]:
    """Solve every experiment of a case in their order, what the tissue remembers carried from one to the next.

    Parameters
    ----------
    setup : Setup
    hypothesis : Hypothesis
    known : fields of a hypothesis near this one
    progress : called with (load steps solved, load steps in all)
    every : how many poses of the gripper on there is to be a solved one, where nothing remembers and the tissue answers
        smoothly between them
    besides : of each experiment, load steps of which the poses are solved in any case

    Raises
    ------
    SolverError
        A load step has no equilibrium.
    """
    group = rows_as_load_steps if hypothesis.rate_dependent else load_steps_of
    all_load_steps = [
        group(experiment, load.felt) for experiment, load in zip(setup.experiments, setup.loads, strict=True)
    ]
    total, done = sum(len(load_steps) for load_steps in all_load_steps), 0
    changed = hypothesis.problem(setup.problem)
    follower = Follower(changed, hypothesis.material(), setup.settings.solver, beside=known is not None)
    solutions = []
    history = TermHistory(hypothesis)
    for number, load_steps in enumerate(all_load_steps):
        motion = hypothesis.motion(reported_motion(load_steps, hypothesis, setup.loads[number].unit_wrench))
        history.begin(changed, load_steps.experiment)
        path = Path(follower, history, load_steps, motion, known[number] if known is not None else None)
        also = besides[number] if besides else ()
        between = spread_between(motion, every, also) if every > 1 and history.steady else None
        states: list[EquilibriumState] = []
        for load_step in np.arange(len(load_steps)) if between is None else between.solved:
            states.append(path.solved(int(load_step)))
            if progress is not None:
                progress(done + int(load_step) + 1, total)
        if between is not None:
            states, between = path.without_kinks(states, between)
        done += len(load_steps)
        solutions.append(
            Solution(
                load_steps,
                setup.loads[number].unit_wrench,
                motion,
                changed,
                setup.problem,
                tuple(states),
                between,
            )
        )
    seen = hypothesis.with_beads(changed, displacement_at_rest(solutions[0]))
    return [replace(solution, problem=seen) for solution in solutions]


def displacement_at_rest(solution: Solution) -> FloatArray:
    """Return how the nodes are displaced (n, 3), m, with the gripper exactly at its stated rest pose.

    By the noise of the first pose beads would seem to sit elsewhere on the tissue, whatever little displaces them.
    """
    first = solution.states[0]
    return first.displacement - linear_change(solution.problem, first, solution.load_steps.off_rest)


def reported_motion(load_steps: LoadSteps, hypothesis: Hypothesis, unit_wrench: FloatArray) -> Motion:
    """Return the motion of the gripper as it was reported.

    ``unit_wrench`` (n, 6) is the baseline's wrench per unit of Young's modulus, by row.
    """
    _, first = np.unique(load_steps.of_row, return_index=True)
    trial = hypothesis.youngs_modulus * unit_wrench[first]
    return Motion(
        load_steps.experiment,
        load_steps.position,
        load_steps.rotation,
        load_steps.load,
        trial,
        load_steps.time,
    )


def motion_by_row(solution: Solution, hypothesis: Hypothesis) -> Motion:
    """Return the reported motion of a solved experiment row by row: load steps do not see what a hold does."""
    load_steps = solution.load_steps
    rows, trial = load_steps.of_row, hypothesis.youngs_modulus * solution.unit_wrench
    return Motion(
        load_steps.experiment,
        load_steps.position[rows],
        load_steps.rotation[rows],
        load_steps.load[rows],
        trial,
        load_steps.experiment.time,
    )
