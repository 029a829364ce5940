"""A case solved under a hypothesis: the equilibria of every experiment, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.model.grip_load import GripLoad
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.load_steps import Visits, rows_as_visits, visits_of
from estimator.diagnosis.model.term_history import TermChain
from estimator.effects.effect import Motion
from estimator.errors import SolverError
from estimator.experiment import Experiment
from estimator.fem.equilibrium import EquilibriumSolver, NewtonSettings
from estimator.fem.equilibrium_state import EquilibriumState, linear_change
from estimator.fem.motion import GripperPose
from estimator.fem.observation import Observation, observe
from estimator.fem.problem import RetractionProblem
from estimator.fem.terms import Term
from estimator.fit.parameters import POISSON_RATIO
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]
Progress = Callable[[int, int], None]

# The measurements resolve a thousandth. Derivatives a few per cent off lengthen a fit by an iteration at most.
# Where a neighbour's fields are known a state is either near or not worth a long search.
_FROM_REST = NewtonSettings(tolerance=1e-6, chord_rate=0.3, smallest_fraction=1 / 32, tangent_reuse=0.05)
_FROM_A_NEIGHBOUR = replace(_FROM_REST, iterations=12)
# A step of a refit that is as hard to follow as this is rather shortened: to find that there is no equilibrium costs
# more than several points.
_AFTER_STRAYS = replace(_FROM_REST, smallest_fraction=1 / 4)
# Once so many visits lie too far from the neighbour's, its fields are left and the motion is followed instead.
_STRAYS = 3


@dataclass(frozen=True)
class KnownField:
    """A solved field from which another hypothesis starts: displacements (n, 3), m, and pressures (e, q), Pa."""

    displacement: FloatArray
    pressure: FloatArray


# For each experiment, by row, the field of the visit that the row belongs to.
KnownFields = Sequence[Sequence[KnownField]]


@dataclass(frozen=True)
class Passage:
    """One experiment solved under a hypothesis.

    Attributes
    ----------
    visits : Visits
    unit_wrench : (n, 6) of the baseline by row, per unit of Young's modulus
    motion : true motion of the gripper at the visits
    problem, baseline : the boundary value problem that was solved, and the one without any effect
    states : of every visit
    """

    visits: Visits
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
        return [fields[visit] for visit in self.visits.of_row]


@dataclass(frozen=True)
class Mechanics:
    """The observables of one solved experiment before any sensor, with their derivatives, visit by visit."""

    passage: Passage
    observations: tuple[Observation, ...]

    @property
    def wrench(self) -> FloatArray:
        """Return the wrench at every visit, (v, 6)."""
        return np.array([o.wrench for o in self.observations])

    @property
    def fiducials(self) -> FloatArray:
        """Return the fiducials at every visit, (v, m, 3)."""
        return np.array([o.fiducials for o in self.observations])

    def without_states(self) -> Mechanics:
        """Return the observables alone, which is less to keep and can go to another process."""
        light = tuple(replace(observation, field_by={}) for observation in self.observations)
        return Mechanics(replace(self.passage, states=()), light)

    def at(self, before: Hypothesis, after: Hypothesis) -> Mechanics:
        """Extrapolate the observables of the baseline to another E and ν nearby.

        Every force is proportional to E; the rest is linear in −ln(1 − 2ν).
        """
        ratio = after.youngs_modulus / before.youngs_modulus
        old, new = before.poisson_ratio, after.poisson_ratio
        along = POISSON_RATIO.to_internal(new) - POISSON_RATIO.to_internal(old)
        change = POISSON_RATIO.slope(old) * along
        modulus = after.youngs_modulus
        return Mechanics(
            self.passage, tuple(_extrapolated(o, ratio, change, modulus) for o in self.observations)
        )


def mechanics_of(passage: Passage) -> Mechanics:
    """Evaluate the observables of every visit."""
    of_state = {id(state): observe(passage.problem, state) for state in passage.distinct_states}
    return Mechanics(passage, tuple(of_state[id(state)] for state in passage.states))


def _extrapolated(observation: Observation, ratio: float, change: float, modulus: float) -> Observation:
    """Multiply E by ``ratio`` to ``modulus``, and move ν, as it were, by ``change``."""
    by_ratio = observation.wrench_by["poisson_ratio"]
    wrench = ratio * (observation.wrench + change * by_ratio)
    return replace(
        observation,
        wrench=wrench,
        fiducials=observation.fiducials + change * observation.fiducials_by["poisson_ratio"],
        wrench_by={"youngs_modulus": wrench / modulus, "poisson_ratio": ratio * by_ratio},
        wrench_by_pose=ratio * observation.wrench_by_pose,
    )


def solve_case(
    problem: RetractionProblem,
    experiments: Sequence[Experiment],
    hypothesis: Hypothesis,
    loads: Sequence[GripLoad],
    known: KnownFields | None = None,
    progress: Progress | None = None,
) -> list[Passage]:
    """Solve every experiment of a case in their order, what the tissue remembers carried from one to the next.

    Parameters
    ----------
    problem : of the baseline
    experiments : in the order in which they were done
    hypothesis : Hypothesis
    loads : of each experiment
    known : fields of a hypothesis near this one
    progress : called with (visits solved, visits in all)

    Raises
    ------
    SolverError
        A visit has no equilibrium.
    """
    group = rows_as_visits if hypothesis.rate_dependent else visits_of
    all_visits = [group(experiment, load.felt) for experiment, load in zip(experiments, loads, strict=True)]
    total, done = sum(len(visits) for visits in all_visits), 0
    changed = hypothesis.problem(problem)
    following = EquilibriumSolver(changed, _FROM_REST if known is None else _AFTER_STRAYS)
    nearby = following.with_settings(_FROM_A_NEIGHBOUR)
    material, strays = hypothesis.material(), 0
    passages = []
    chain = TermChain(hypothesis)
    for number, visits in enumerate(all_visits):
        motion = hypothesis.motion(reported_motion(visits, hypothesis, loads[number].unit_wrench))
        chain.begin(changed, visits.experiment)
        states: list[EquilibriumState] = []
        been: dict[bytes, EquilibriumState] = {}
        for visit in range(len(visits)):
            elapsed = float(visits.time[visit] - visits.time[visit - 1]) if visit else 0.0
            terms = chain.at(elapsed)
            pose = GripperPose(motion.position[visit], motion.rotation[visit])
            last = states[-1] if states else None
            field = _expected(known[number], visits, visit, last) if known is not None else None
            # Tissue on which nothing acts that remembers or waits is as it was where the gripper has been before.
            state = been.get(_place(pose)) if chain.steady else None
            state = state or _near(nearby, material, pose, terms, field, last)
            if state is None:
                strays += known is not None
                if strays > _STRAYS:
                    known = None
                state = following.solve(pose, material, last or following.rest(material), terms)
            chain.pass_by(state.displacement, state.response)
            states.append(state)
            been[_place(pose)] = state
            done += 1
            if progress is not None:
                progress(done, total)
        passages.append(Passage(visits, loads[number].unit_wrench, motion, changed, problem, tuple(states)))
    seen = hypothesis.with_beads(changed, displacement_at_rest(passages[0]))
    return [replace(passage, problem=seen) for passage in passages]


def displacement_at_rest(passage: Passage) -> FloatArray:
    """Return how the nodes are displaced (n, 3), m, with the gripper exactly at its stated rest pose.

    By the noise of the first pose beads would seem to sit elsewhere on the tissue, whatever little displaces them.
    """
    first = passage.states[0]
    return first.displacement - linear_change(passage.problem, first, passage.visits.off_rest)


def reported_motion(visits: Visits, hypothesis: Hypothesis, unit_wrench: FloatArray) -> Motion:
    """Return the motion of the gripper as it was reported.

    ``unit_wrench`` (n, 6) is the baseline's wrench per unit of Young's modulus, by row.
    """
    _, first = np.unique(visits.of_row, return_index=True)
    trial = hypothesis.youngs_modulus * unit_wrench[first]
    return Motion(visits.experiment, visits.position, visits.rotation, visits.load, trial, visits.time)


def motion_by_row(passage: Passage, hypothesis: Hypothesis) -> Motion:
    """Return the reported motion of a solved experiment row by row: what goes on in a hold is not seen by visits."""
    visits = passage.visits
    rows, trial = visits.of_row, hypothesis.youngs_modulus * passage.unit_wrench
    return Motion(
        visits.experiment,
        visits.position[rows],
        visits.rotation[rows],
        visits.load[rows],
        trial,
        visits.experiment.time,
    )


def _expected(
    known: Sequence[KnownField], visits: Visits, visit: int, last: EquilibriumState | None
) -> KnownField:
    """Return the neighbour's field at a visit, as far from it as the last state was from its field then."""
    here = known[_first_row(visits, visit)]
    if last is None:
        return here
    before = known[_first_row(visits, visit - 1)]
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
    try:
        if known is not None:
            return solver.refine(pose, material, known.displacement, known.pressure, terms, tangent)
    except SolverError:
        # Too far for Newton's method in one step; the motion is followed instead.
        return None
    return None


def _same_pose(one: GripperPose, other: GripperPose) -> bool:
    return bool(np.all(one.increment_to(other) == 0.0))


def _place(pose: GripperPose) -> bytes:
    return pose.position.tobytes() + pose.rotation.as_quat(canonical=True).tobytes()


def _first_row(visits: Visits, visit: int) -> int:
    return int(np.searchsorted(visits.of_row, visit))
