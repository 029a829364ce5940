"""Load steps between solved ones: the tissue's answer there follows from the states on both sides.

Tissue that remembers nothing answers to the gripper's pose alone, and smoothly. Between two solved poses everything is
on the cubic that agrees with both states and with their derivatives by the pose (Hermite), whose error falls with the
fourth power of the distance. What a pose lies off the way from one to the other counts to first order. Each solved
state can be foretold from its neighbours in the same way: over twice the distance, with sixteen times the error. Where
that fails, at a kink, the load steps around it are to be solved themselves.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator

from estimator.effects.effect import Motion
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.observation import Observation
from estimator.fem.equilibrium.state import EquilibriumState

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
# Values (c,) and their derivative (c, 6) by the gripper's pose.
Answer = tuple[FloatArray, FloatArray]

# A rotation counts as the motion that it gives a point at this distance from the gripper frame's origin, m.
_LEVER_M = 0.01
# What lies farther off the way between two poses than this share of it does not lie between them.
_ASIDE = 0.1
# Fewer ways between solved poses than these do not tell whether the tissue answers smoothly.
_FEWEST = 4


@dataclass(frozen=True, eq=False)
class Chord:
    """Where poses lie between two others each.

    Attributes
    ----------
    step : (k, 6) motion of the gripper from the one to the other, m and rad
    share : (k,) of it that leads nearest
    off : (k, 6) motion from there to the pose
    """

    step: FloatArray
    share: FloatArray
    off: FloatArray

    @property
    def holds(self) -> BoolArray:
        """Whether each (k,) does lie between its two."""
        aside = _length(self.off) <= _ASIDE * _length(self.step)
        return np.asarray(aside & (self.share >= 0.0) & (self.share <= 1.0))

    def cubic(self, number: int, first: Answer, last: Answer) -> FloatArray:
        """Return the values (c,) at the pose of this number, from those at both of its others."""
        t, step, off = self.share[number], self.step[number], self.off[number]
        (value, by_pose), (last_value, last_by_pose) = first, last
        along = last_value - value
        bent = (1.0 - t) * (by_pose @ step - along) - t * (last_by_pose @ step - along)
        aside = (1.0 - t) * (by_pose @ off) + t * (last_by_pose @ off)
        return np.asarray(value + t * along + t * (1.0 - t) * bent + aside)


@dataclass(frozen=True, eq=False)
class Between:
    """Which of the v load steps of an experiment are solved, the others lying between them.

    Attributes
    ----------
    motion : true motion of the gripper at the load steps
    visits : (p,) load steps at which a pose is met for the first time, ascending
    place : (v,) for each load step the number of its pose among these
    solved : (s,) those that are solved, ascending
    """

    motion: Motion
    visits: IntArray
    place: IntArray
    solved: IntArray

    @property
    def rest(self) -> IntArray:
        """The visits that are not solved."""
        return np.setdiff1d(self.visits, self.solved)

    def sides(self, load_steps: IntArray) -> tuple[IntArray, IntArray]:
        """Return the numbers (k,), among the solved ones, of those before and after load steps (k,)."""
        after = np.clip(np.searchsorted(self.solved, load_steps), 1, len(self.solved) - 1)
        return after - 1, after

    def chord(self, load_steps: IntArray) -> Chord:
        """Place load steps (k,) between the solved ones before and after them."""
        before, after = self.sides(load_steps)
        return chord_between(self.motion, self.solved[before], self.solved[after], load_steps)

    def with_solved(self, more: IntArray) -> Between:
        """Return the same with more load steps solved."""
        return replace(self, solved=np.union1d(self.solved, more))

    def around(self, numbers: IntArray) -> IntArray:
        """Return the load steps that are not solved next to solved ones of these numbers."""
        before, after = self.sides(self.rest)
        return self.rest[np.isin(before, numbers) | np.isin(after, numbers)]

    def filled(self, values: FloatArray) -> FloatArray:
        """Return values (v, ...) at all load steps, smoothly from those (s, ...) at the solved ones."""
        visits = np.searchsorted(self.visits, self.solved)
        return np.asarray(Akima1DInterpolator(self._way[visits], values)(self._way))[self.place]

    @cached_property
    def _way(self) -> FloatArray:
        """How far (p,) the gripper has come at each visit, m."""
        steps = _increments(self.motion, self.visits[:-1], self.visits[1:])
        return np.concatenate([[0.0], np.cumsum(_length(steps))])


def spread_between(motion: Motion, every: int, besides: Collection[int] = ()) -> Between | None:
    """Choose every so many of the poses of a motion to be solved, and those that do not lie between others.

    Of a short one more are. Besides, those at some load steps are.

    Return None for a gripper that stood throughout.
    """
    poses = np.column_stack([motion.position, motion.rotation.as_quat(canonical=True)])
    _, first, place = np.unique(poses, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    visits = first[order]
    spacing = max(min(every, (len(visits) - 1) // _FEWEST), 1)
    chosen = np.union1d(visits[::spacing], visits[-1:])
    number = np.argsort(order)[place.ravel()]
    between = Between(motion, visits, number, np.union1d(chosen, visits[number[list(besides)]]))
    while len(between.rest) and not between.chord(between.rest).holds.all():
        between = between.with_solved(between.rest[~between.chord(between.rest).holds])
    return between if len(visits) > 1 else None


def chord_between(motion: Motion, before: IntArray, after: IntArray, at: IntArray) -> Chord:
    """Place load steps ``at`` (k,) of a motion between others."""
    step, here = _increments(motion, before, after), _increments(motion, before, at)
    weight = np.array([1.0] * 3 + [_LEVER_M**2] * 3)
    share = (step * here) @ weight / np.maximum(step**2 @ weight, np.finfo(float).tiny)
    return Chord(step, share, here - share[:, None] * step)


def kinks(between: Between, states: Sequence[EquilibriumState], free: IntArray, at_most_m: float) -> IntArray:
    """Return the numbers of solved states that their neighbours foretell worse than by so much, m, at any node.

    Parameters
    ----------
    states : of the solved load steps
    free : (nf,) degrees of freedom that the derivatives of the states are of
    """
    inner = np.arange(1, len(between.solved) - 1)
    steps = between.solved
    chord = chord_between(between.motion, steps[inner - 1], steps[inner + 1], steps[inner])
    answers = [(state.displacement.reshape(-1)[free], state.by_pose) for state in states]
    found = [
        number
        for k, number in enumerate(inner)
        if chord.holds[k]
        and np.abs(chord.cubic(k, answers[number - 1], answers[number + 1]) - answers[number][0]).max()
        > at_most_m
    ]
    return np.array(found, dtype=np.int64)


def fields_between(
    problem: RetractionProblem, between: Between, states: Sequence[EquilibriumState]
) -> dict[int, tuple[FloatArray, FloatArray]]:
    """Return displacements (n, 3), m, and pressures (e, q), Pa, at the load steps that are not solved."""
    free = problem.pattern.free
    chord, (before, after) = between.chord(between.rest), between.sides(between.rest)
    found = {}
    for k, load_step in enumerate(between.rest):
        one, other, t = states[before[k]], states[after[k]], chord.share[k]
        ends = [(state.displacement.reshape(-1)[free], state.by_pose) for state in (one, other)]
        displacement = np.zeros_like(one.displacement)
        displacement.reshape(-1)[free] = chord.cubic(k, *ends)
        pose = GripperPose(between.motion.position[load_step], between.motion.rotation[load_step])
        displacement = problem.imposed(displacement, pose)
        pressure = (1.0 - t) * one.response.pressure + t * other.response.pressure
        found[int(load_step)] = displacement, pressure
    return found


def observations_between(between: Between, observed: Sequence[Observation]) -> tuple[Observation, ...]:
    """Return the observables of all load steps from those of the solved ones.

    Derivatives are interpolated smoothly along the motion; ``field_by`` is left out.
    """

    def answer(one: Observation) -> Answer:
        values = np.concatenate([one.wrench, one.fiducials.ravel()])
        return values, np.concatenate([one.wrench_by_pose, one.fiducials_by_pose.reshape(-1, 6)])

    def filled(of: Sequence[FloatArray]) -> FloatArray:
        return between.filled(np.array(of))

    names = tuple(observed[0].wrench_by)
    wrench_by = {name: filled([one.wrench_by[name] for one in observed]) for name in names}
    fiducials_by = {name: filled([one.fiducials_by[name] for one in observed]) for name in names}
    wrench_by_pose = filled([one.wrench_by_pose for one in observed])
    fiducials_by_pose = filled([one.fiducials_by_pose for one in observed])
    answers = [answer(one) for one in observed]
    rest = between.rest
    chord, (before, after) = between.chord(rest), between.sides(rest)
    values = {int(step): answers[n][0] for n, step in enumerate(between.solved)}
    values |= {
        int(step): chord.cubic(k, answers[before[k]], answers[after[k]]) for k, step in enumerate(rest)
    }
    shape = observed[0].fiducials.shape
    return tuple(
        Observation(
            values[visit][:6],
            values[visit][6:].reshape(shape),
            {name: wrench_by[name][step] for name in names},
            {name: fiducials_by[name][step] for name in names},
            wrench_by_pose[step],
            fiducials_by_pose[step],
            {},
        )
        for step, visit in enumerate(between.visits[between.place].tolist())
    )


def _increments(motion: Motion, start: IntArray, end: IntArray) -> FloatArray:
    """Return translation (m) and rotation vector (rad) from load steps (k,) to others, (k, 6)."""
    turn = (motion.rotation[end] * motion.rotation[start].inv()).as_rotvec()
    return np.hstack([motion.position[end] - motion.position[start], turn])


def _length(increments: FloatArray) -> FloatArray:
    return np.hypot(
        np.linalg.norm(increments[:, :3], axis=1), _LEVER_M * np.linalg.norm(increments[:, 3:], axis=1)
    )
