"""Ways to spoil an experiment: each takes a good one and returns it with one thing wrong."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from estimator.experiment import Experiment


def hung(experiment: Experiment) -> Experiment:
    """The forces of each step as if they were known."""
    return replace(experiment, wrench=experiment.wrench[np.searchsorted(experiment.step, experiment.step)])


def wrench(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Experiment], Experiment]:
    return lambda good: replace(good, wrench=change(good.wrench.copy()))


def beads(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Experiment], Experiment]:
    return lambda good: replace(good, fiducials=change(good.fiducials.copy()))


def rest(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Experiment], Experiment]:
    return lambda good: replace(good, fiducials_rest=change(good.fiducials_rest.copy()))


def stated(**values: object) -> Callable[[Experiment], Experiment]:
    return lambda good: replace(good, **values)


def sensor(**values: float) -> Callable[[Experiment], Experiment]:
    return lambda good: replace(good, sensor=replace(good.sensor, **values))


def phantom(**values: object) -> Callable[[Experiment], Experiment]:
    return lambda good: replace(good, phantom=replace(good.phantom, **values))


def with_rows(
    order: Callable[[int], list[int]], *, times_too: bool = True
) -> Callable[[Experiment], Experiment]:
    """The rows in another order, some of them twice; with their times, or without."""

    def changed(good: Experiment) -> Experiment:
        chosen = order(len(good.time))
        return replace(
            good,
            time=good.time[chosen] if times_too else np.arange(len(chosen), dtype=float),
            phase=tuple(good.phase[i] for i in chosen),
            step=good.step[chosen],
            position=good.position[chosen],
            quaternion_wxyz=good.quaternion_wxyz[chosen],
            wrench=good.wrench[chosen],
            fiducials=good.fiducials[chosen],
        )

    return changed


def column(values: np.ndarray, place: object, change: Callable[[np.ndarray], object]) -> np.ndarray:
    values[place] = change(values[place])
    return values
