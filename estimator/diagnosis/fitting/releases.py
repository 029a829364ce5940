"""Where a search should begin for what sets nodes free, by what it does at its full size.

Derivatives at the null tell where something gives way, but hardly how far: a stretch of an anchor that is off takes its
share of the load off the neighbours, which a small one does not. On a solved state, condensed onto the nodes that may
come free, one Newton step gives the answer to any stretch. A few states are enough to choose among many.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.fitting.case import Case, Linearisation, predictions
from estimator.diagnosis.model.free_parameters import free_parameters, moved
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.solution import Mechanics, Solution, mechanics_of, solve_case
from estimator.diagnosis.sensitivity.constraint_release import changes_by_release
from estimator.effects.effect import Effect, Values
from estimator.forward.schedule import schedule_poses, spread_states, travel
from estimator.inference.channels import channels_by, measured_rows, side_by_side

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Release:
    """Something that gives way, at its full size.

    Attributes
    ----------
    start : the hypothesis with it, and with the E and ν that go with it
    left : sum of squares that it leaves of a few states, in units of the noise
    """

    start: Hypothesis
    left: float


def starts_at_full_size(case: Case, base: Linearisation, effect: Effect, count: int) -> list[Hypothesis]:
    """Return at most so many hypotheses at which a refit of an effect should begin beside a solved one, the best first.

    One Newton step tells what gives way nearly as a refit does: what falls behind the best is not begun from.
    """
    every = case.settings.solver.poses_apart
    mechanics = [mechanics_of(one) for one in solve_case(case, base.hypothesis, base.known, every=every)]
    found = releases_of(case, mechanics, base.hypothesis, effect)
    close = 2.0 * case.settings.search.close
    return [one.start for one in found[:count] if one.left < found[0].left + close]


def releases_of(
    case: Case, mechanics: Sequence[Mechanics], hypothesis: Hypothesis, effect: Effect
) -> list[Release]:
    """Return all that an effect looks over beside a solved hypothesis, what leaves least first.

    In place of the best stands what is still better near it. To first order in E and ν, and in the tissue, but not in
    what gives way.
    """
    values = effect.looked_over()
    if not values:
        return []
    states = _FewStates.of(case, mechanics, hypothesis)
    best, *others = states.releases(effect, values)
    nearer = effect.looked_over(best.start.values[-1])
    if nearer:
        best = min(best, *states.releases(effect, nearer), key=lambda one: one.left)
    return [best, *others]


@dataclass(frozen=True, eq=False)
class _FewStates:
    """A few solved states of each experiment.

    Attributes
    ----------
    case, hypothesis : of which they are
    solutions : of each experiment, thinned out to them
    misfit, by_material : (r,) and (r, 2), in units of the noise
    """

    case: Case
    hypothesis: Hypothesis
    solutions: Sequence[Solution]
    misfit: FloatArray
    by_material: FloatArray

    @classmethod
    def of(cls, case: Case, mechanics: Sequence[Mechanics], hypothesis: Hypothesis) -> _FewStates:
        count = case.settings.noise.corrected_states
        chosen = [_few_load_steps(one.solution, count) for one in mechanics]
        misfit, by_material = _misfits(case, mechanics, hypothesis, chosen)
        thinned = [_thinned(one, steps).solution for one, steps in zip(mechanics, chosen, strict=True)]
        return cls(case, hypothesis, thinned, misfit, by_material)

    def releases(self, effect: Effect, values: Sequence[Values]) -> list[Release]:
        """Return the releases of an effect at some values, what leaves least first."""
        releasing = [self.hypothesis.with_effect(effect, each) for each in values]
        changes = changes_by_release(self.solutions, self.hypothesis, releasing)
        free = free_parameters(self.hypothesis, self.case.settings.fitting)
        longest = np.array([parameter.longest_step for parameter in free])
        found = []
        for released, of_experiments in zip(releasing, changes, strict=True):
            change = [
                side_by_side(one.wrench, one.fiducials) / whitening.deviation
                for one, whitening in zip(of_experiments, self.case.whitenings, strict=True)
            ]
            left = self.misfit - np.where(np.isfinite(self.misfit), np.concatenate(change).ravel(), np.nan)
            seen = np.isfinite(left)
            step, *_ = np.linalg.lstsq(self.by_material[seen], left[seen], rcond=None)
            step = np.clip(step, -longest, longest)
            remaining = left[seen] - self.by_material[seen] @ step
            found.append(Release(moved(released, free, step), float(remaining @ remaining)))
        return sorted(found, key=lambda one: one.left)


def _few_load_steps(solution: Solution, count: int) -> IntArray:
    """Return a few solved load steps, spread over the motion."""
    load_steps, solved = solution.load_steps, solution.solved
    schedule = schedule_poses(load_steps.experiment)
    way = travel(schedule)[schedule.state_of_row][np.searchsorted(load_steps.of_row, solved)]
    wanted = travel(schedule)[spread_states(schedule, count)]
    return np.unique(solved[np.argmin(np.abs(way[:, None] - wanted), axis=0)])


def _thinned(mechanics: Mechanics, steps: IntArray) -> Mechanics:
    """Return the mechanics of some load steps alone, as if each had one row."""
    whole = mechanics.solution.load_steps
    few = replace(
        whole,
        position=whole.position[steps],
        rotation=whole.rotation[steps],
        pose_variance=whole.pose_variance[steps],
        time=whole.time[steps],
        of_row=np.arange(len(steps)),
        load=whole.load[steps],
    )
    solved = np.searchsorted(mechanics.solution.solved, steps)
    states = tuple(mechanics.solution.states[number] for number in solved)
    return Mechanics(
        replace(mechanics.solution, load_steps=few, states=states, between=None),
        tuple(mechanics.observations[step] for step in steps),
    )


def _misfits(
    case: Case, mechanics: Sequence[Mechanics], hypothesis: Hypothesis, chosen: Sequence[IntArray]
) -> tuple[FloatArray, FloatArray]:
    """Return misfit (r,) of the chosen load steps and its derivatives (r, 2) by E and ν, in units of the noise."""
    free = free_parameters(hypothesis, case.settings.fitting)
    misfit, by_material = [], []
    whole = zip(mechanics, predictions(case, mechanics, hypothesis), chosen, strict=True)
    for number, (one, predicted, steps) in enumerate(whole):
        load_steps, deviation = one.solution.load_steps, case.whitenings[number].deviation
        off = (measured_rows(load_steps.experiment) - predicted) / deviation
        misfit += [off[load_steps.of_row == step].mean(axis=0) for step in steps]
        by_material += [
            np.column_stack([p.slope * channels_by(one.observations[step], p.name) / deviation for p in free])
            for step in steps
        ]
    return np.concatenate(misfit), np.concatenate(by_material)
