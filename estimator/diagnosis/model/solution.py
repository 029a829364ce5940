"""A case solved under a hypothesis: the equilibria of every experiment, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.load_steps import LoadSteps, load_steps_of, rows_as_load_steps
from estimator.diagnosis.model.setup import Setup
from estimator.diagnosis.model.term_history import TermHistory
from estimator.diagnosis.settings import SolverSettings
from estimator.effects.effect import Motion
from estimator.errors import SolverError
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.newton import EquilibriumSolver, NewtonSettings
from estimator.fem.equilibrium.observation import Observation, observe
from estimator.fem.equilibrium.settling import settled
from estimator.fem.equilibrium.state import EquilibriumState, linear_change
from estimator.fem.terms.term import Term
from estimator.inference.extrapolation import extrapolated
from estimator.inference.material_parameters import POISSON_RATIO, YOUNGS_MODULUS
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class KnownField:
    """A solved field from which another hypothesis starts: displacements (n, 3), m, and pressures (e, q), Pa."""

    displacement: FloatArray
    pressure: FloatArray


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
    states : of every load step
    """

    load_steps: LoadSteps
    unit_wrench: FloatArray
    motion: Motion
    problem: RetractionProblem
    baseline: RetractionProblem
    states: tuple[EquilibriumState, ...]

    @property
    def distinct_states(self) -> list[EquilibriumState]:
        """The states without those that are met again."""
        return list({id(state): state for state in self.states}.values())

    def known_fields(self) -> list[KnownField]:
        """Return the fields by row."""
        fields = [KnownField(state.displacement, state.response.pressure) for state in self.states]
        return [fields[load_step] for load_step in self.load_steps.of_row]


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
        return Mechanics(replace(self.solution, states=()), light)

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
    return Mechanics(solution, tuple(of_state[id(state)] for state in solution.states))


def solve_case(
    setup: Setup,
    hypothesis: Hypothesis,
    known: KnownFields | None = None,
    progress: Progress | None = None,
) -> list[Solution]:
    """Solve every experiment of a case in their order, what the tissue remembers carried from one to the next.

    Parameters
    ----------
    setup : Setup
    hypothesis : Hypothesis
    known : fields of a hypothesis near this one
    progress : called with (load steps solved, load steps in all)

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
    settings = setup.settings.solver
    newton = _newton(settings)
    # A refit's step that is hard to follow is rather shortened: to find that there is no equilibrium costs more than
    # several points.
    smallest = settings.smallest_step if known is None else settings.smallest_step_of_refit
    # A thin sheet bends so easily that its tangent may be indefinite on the way to a stable state: the shortest steps
    # go on all the same.
    through = max(newton.unstable_fraction, smallest)
    following = EquilibriumSolver(
        changed, replace(newton, smallest_fraction=smallest, unstable_fraction=through)
    )
    nearby = following.with_settings(replace(newton, iterations=settings.iterations_beside_neighbour))
    material, strays = hypothesis.material(), 0
    solutions = []
    history = TermHistory(hypothesis)
    for number, load_steps in enumerate(all_load_steps):
        motion = hypothesis.motion(reported_motion(load_steps, hypothesis, setup.loads[number].unit_wrench))
        history.begin(changed, load_steps.experiment)
        states: list[EquilibriumState] = []
        been: dict[bytes, EquilibriumState] = {}
        for load_step in range(len(load_steps)):
            elapsed = float(load_steps.time[load_step] - load_steps.time[load_step - 1]) if load_step else 0.0
            terms = history.at(elapsed)
            pose = GripperPose(motion.position[load_step], motion.rotation[load_step])
            last = states[-1] if states else None
            field = _expected(known[number], load_steps, load_step, last) if known is not None else None
            # Tissue on which nothing acts that remembers or waits is as it was where the gripper has been before.
            state = been.get(_place(pose)) if history.steady else None
            state = state or _near(nearby, material, pose, terms, field, last)
            if state is None:
                strays += known is not None
                if strays > settings.strays:
                    known = None
                state = following.solve(pose, material, last or settled(following, material), terms)
            history.pass_by(state.displacement, state.response)
            states.append(state)
            been[_place(pose)] = state
            done += 1
            if progress is not None:
                progress(done, total)
        solutions.append(
            Solution(
                load_steps, setup.loads[number].unit_wrench, motion, changed, setup.problem, tuple(states)
            )
        )
    seen = hypothesis.with_beads(changed, displacement_at_rest(solutions[0]))
    return [replace(solution, problem=seen) for solution in solutions]


def _newton(settings: SolverSettings) -> NewtonSettings:
    return NewtonSettings(
        tolerance=settings.tolerance,
        chord_rate=settings.chord_rate,
        smallest_fraction=settings.smallest_step,
        tangent_reuse=settings.tangent_reuse,
    )


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


def _expected(
    known: Sequence[KnownField], load_steps: LoadSteps, load_step: int, last: EquilibriumState | None
) -> KnownField:
    """Return the neighbour's field at a load step, as far from it as the last state was from its field then."""
    here = known[_first_row(load_steps, load_step)]
    if last is None:
        return here
    before = known[_first_row(load_steps, load_step - 1)]
    return KnownField(
        here.displacement + last.displacement - before.displacement,
        here.pressure + last.response.pressure - before.pressure,
    )


def _near(
    solver: EquilibriumSolver,
    material: Material,
    pose: GripperPose,
    terms: tuple[Term, ...],
    known: KnownField | None,
    last: EquilibriumState | None,
) -> EquilibriumState | None:
    """Return the equilibrium near the last one where the gripper stands, else near a known field, else None."""
    # Where the gripper stands only what the tissue remembers has changed.
    tangent = last.tangent if last is not None and _same_pose(last.pose, pose) else None
    if known is None and last is not None and tangent is not None:
        known = KnownField(last.displacement, last.response.pressure)
    found = None
    if known is not None:
        # Where it is too far for Newton's method in one step the motion is followed instead.
        with suppress(SolverError):
            found = solver.refine(pose, material, known.displacement, known.pressure, terms, tangent)
    return found


def _same_pose(one: GripperPose, other: GripperPose) -> bool:
    return bool(np.all(one.increment_to(other) == 0.0))


def _place(pose: GripperPose) -> bytes:
    return pose.position.tobytes() + pose.rotation.as_quat(canonical=True).tobytes()


def _first_row(load_steps: LoadSteps, load_step: int) -> int:
    return int(np.searchsorted(load_steps.of_row, load_step))
