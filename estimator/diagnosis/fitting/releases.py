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
from estimator.effects.effect import Effect
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
    """Return so many hypotheses at which a refit of an effect should begin beside a solved one, the best first."""
    every = case.settings.solver.poses_apart
    mechanics = [mechanics_of(one) for one in solve_case(case, base.hypothesis, base.known, every=every)]
    return [one.start for one in releases_of(case, mechanics, base.hypothesis, effect)[:count]]


def releases_of(
    case: Case, mechanics: Sequence[Mechanics], hypothesis: Hypothesis, effect: Effect
) -> list[Release]:
    """Return all that an effect looks over beside a solved hypothesis, what leaves least first.

    To first order in E and ν, and in the tissue, but not in what gives way.
    """
    values = effect.looked_over()
    if not values:
        return []
    count = case.settings.noise.corrected_states
    chosen = [_few_load_steps(one.solution, count) for one in mechanics]
    misfit, by_material = _misfits(case, mechanics, hypothesis, chosen)
    releasing = [hypothesis.with_effect(effect, each) for each in values]
    thinned = [_thinned(one, steps).solution for one, steps in zip(mechanics, chosen, strict=True)]
    changes = changes_by_release(thinned, hypothesis, releasing)
    free = free_parameters(hypothesis, case.settings.fitting)
    longest = np.array([parameter.longest_step for parameter in free])
    found = []
    for released, of_experiments in zip(releasing, changes, strict=True):
        change = [
            side_by_side(one.wrench, one.fiducials) / whitening.deviation
            for one, whitening in zip(of_experiments, case.whitenings, strict=True)
        ]
        left = misfit - np.where(np.isfinite(misfit), np.concatenate(change).ravel(), np.nan)
        seen = np.isfinite(left)
        step, *_ = np.linalg.lstsq(by_material[seen], left[seen], rcond=None)
        step = np.clip(step, -longest, longest)
        remaining = left[seen] - by_material[seen] @ step
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
        position_variance=whole.position_variance[steps],
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
