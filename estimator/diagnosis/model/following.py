"""The equilibria along one experiment: near a neighbour's fields as long as these lead there, else along the motion."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.model.between import Between, fields_between, kinks
from estimator.diagnosis.model.load_steps import LoadSteps
from estimator.diagnosis.model.term_history import TermHistory
from estimator.diagnosis.settings import SolverSettings
from estimator.effects.effect import Motion
from estimator.errors import SolverError
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.newton import EquilibriumSolver, NewtonSettings
from estimator.fem.equilibrium.settling import settled
from estimator.fem.equilibrium.state import EquilibriumState
from estimator.fem.terms.term import Term
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

# How far beyond two solved load steps, in their distance, the difference from a neighbour is extrapolated.
_FARTHEST = 2.0


@dataclass(frozen=True)
class KnownField:
    """A solved field from which another hypothesis starts: displacements (n, 3), m, and pressures (e, q), Pa."""

    displacement: FloatArray
    pressure: FloatArray

    @classmethod
    def of(cls, state: EquilibriumState) -> KnownField:
        """Return the field of a solved state."""
        return cls(state.displacement, state.response.pressure)

    def plus(self, share: float, one: KnownField, other: KnownField) -> KnownField:
        """Return the field with a share of what another one is off a third."""
        return KnownField(
            self.displacement + share * (one.displacement - other.displacement),
            self.pressure + share * (one.pressure - other.pressure),
        )


class Follower:
    """Solves one boundary value problem at one pose after the other.

    Parameters
    ----------
    problem, material : of the hypothesis
    settings : how exactly it is solved
    beside : whether a neighbour's fields are known; too many load steps off these, and they are forgotten
    """

    def __init__(
        self, problem: RetractionProblem, material: Material, settings: SolverSettings, *, beside: bool
    ) -> None:
        # A refit's step that is hard to follow is rather shortened: to find that there is no equilibrium costs more
        # than several points.
        smallest = settings.smallest_step_of_refit if beside else settings.smallest_step
        newton = NewtonSettings(
            tolerance=settings.tolerance, chord_rate=settings.chord_rate, tangent_reuse=settings.tangent_reuse
        )
        # A thin sheet bends so easily that its tangent may be indefinite on the way to a stable state: the shortest
        # steps go on all the same.
        through = max(newton.unstable_fraction, smallest)
        following = replace(newton, smallest_fraction=smallest, unstable_fraction=through)
        self.problem = problem
        self.beside = beside
        self.settings = settings
        self._material = material
        self._following = EquilibriumSolver(problem, following)
        self._nearby = self._following.with_settings(
            replace(newton, iterations=settings.iterations_beside_neighbour)
        )
        self._strays = 0

    def state(
        self,
        pose: GripperPose,
        terms: tuple[Term, ...],
        field: KnownField | None,
        last: EquilibriumState | None,
    ) -> EquilibriumState:
        """Return the equilibrium at a pose under terms.

        Parameters
        ----------
        field : near it, if any is known
        last : the state before; None where the motion starts from rest

        Raises
        ------
        SolverError
            There is none that can be reached.
        """
        found = self._near(pose, terms, field, last)
        if found is None:
            self._strays += self.beside
            self.beside = self.beside and self._strays <= self.settings.strays
            start = last or settled(self._following, self._material, terms)
            found = self._following.solve(pose, self._material, start, terms)
        return found

    def _near(
        self,
        pose: GripperPose,
        terms: tuple[Term, ...],
        field: KnownField | None,
        last: EquilibriumState | None,
    ) -> EquilibriumState | None:
        """Return the equilibrium near the last one where the gripper stands, else near a field, else None."""
        # Where the gripper stands only what the tissue remembers has changed.
        tangent = last.tangent if last is not None and _same_pose(last.pose, pose) else None
        if field is None and last is not None and tangent is not None:
            field = KnownField.of(last)
        found = None
        if field is not None:
            # Where it is too far for Newton's method in one step the motion is followed instead.
            with suppress(SolverError):
                found = self._nearby.refine(
                    pose, self._material, field.displacement, field.pressure, terms, tangent
                )
        return found


class Path:
    """The load steps of one experiment, solved in turn.

    Parameters
    ----------
    follower : of all experiments
    history : of the terms, begun for this experiment
    load_steps, motion : of the experiment, and the true motion
    known : by row, the fields of a neighbour, if there is one
    """

    def __init__(
        self,
        follower: Follower,
        history: TermHistory,
        load_steps: LoadSteps,
        motion: Motion,
        known: Sequence[KnownField] | None,
    ) -> None:
        self._follower = follower
        self._history = history
        self._time = load_steps.time
        self._motion = motion
        rows = np.searchsorted(load_steps.of_row, np.arange(len(load_steps)))
        self._known = None if known is None else [known[row] for row in rows]
        self._passed: list[tuple[int, EquilibriumState]] = []
        self._been: dict[bytes, EquilibriumState] = {}

    def solved(self, load_step: int) -> EquilibriumState:
        """Return the state at the next load step, and pass by it.

        Raises
        ------
        SolverError
            It has no equilibrium.
        """
        elapsed = float(self._time[load_step] - self._time[load_step - 1]) if load_step else 0.0
        pose = GripperPose(self._motion.position[load_step], self._motion.rotation[load_step])
        terms = self._history.at(elapsed, pose)
        last = self._passed[-1][1] if self._passed else None
        # Tissue on which nothing acts that remembers or waits is as it was where the gripper has been before.
        state = self._been.get(_place(pose)) if self._history.steady else None
        state = state or self._follower.state(pose, terms, self._expected(load_step, pose), last)
        self._history.pass_by(state.displacement, state.response)
        self._passed.append((load_step, state))
        self._been[_place(pose)] = state
        return state

    def without_kinks(
        self, states: Sequence[EquilibriumState], between: Between
    ) -> tuple[list[EquilibriumState], Between]:
        """Return the states with all those around kinks of the tissue's answer solved as well.

        Raises
        ------
        SolverError
            One of them has no equilibrium.
        """
        follower, problem = self._follower, self._follower.problem
        bent = kinks(between, states, problem.pattern.free, follower.settings.smooth_m)
        more = between.around(bent)
        fields = fields_between(problem, between, states) if len(more) else {}
        found = dict(zip(between.solved.tolist(), states, strict=True))
        for load_step in more.tolist():
            pose = GripperPose(self._motion.position[load_step], self._motion.rotation[load_step])
            before, _ = between.sides(np.array([load_step]))
            last, field = states[before[0]], KnownField(*fields[load_step])
            found[load_step] = follower.state(pose, self._history.at(0.0, pose), field, last)
        return [found[step] for step in sorted(found)], between.with_solved(more)

    def _expected(self, load_step: int, pose: GripperPose) -> KnownField | None:
        """Return the neighbour's field at a load step, off it as the last states make one expect."""
        known = self._known if self._follower.beside else None
        here = None if known is None else known[load_step]
        if known is not None and here is not None and self._passed:
            (earlier, before), (number, last) = self._passed[-2:][0], self._passed[-1]
            share = _share(before.pose, last.pose, pose)
            here = here.plus(1.0 + share, KnownField.of(last), known[number])
            here = here.plus(-share, KnownField.of(before), known[earlier])
        return here


def _share(before: GripperPose, last: GripperPose, pose: GripperPose) -> float:
    """Return how far a pose lies beyond the last step of the gripper's position, in that step."""
    step, onward = last.position - before.position, pose.position - last.position
    share = float(step @ onward) / max(float(step @ step), np.finfo(float).tiny)
    return share if abs(share) <= _FARTHEST else 0.0


def _same_pose(one: GripperPose, other: GripperPose) -> bool:
    return bool(np.all(one.increment_to(other) == 0.0))


def _place(pose: GripperPose) -> bytes:
    return pose.position.tobytes() + pose.rotation.as_quat(canonical=True).tobytes()
