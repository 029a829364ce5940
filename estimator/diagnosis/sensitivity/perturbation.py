"""A small step of a hypothesis, and how it changes the mechanics of an experiment."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.solution import Solution
from estimator.effects.effect import Effect

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Perturbation:
    """A hypothesis a small step away from another.

    Attributes
    ----------
    name : what is perturbed
    to : the perturbed hypothesis
    effect : the effect whose parameter it is; None for E and ν
    step : size of the perturbation, internal units
    """

    name: str
    to: Hypothesis
    effect: Effect | None
    step: float


@dataclass(frozen=True)
class MechanicalChange:
    """The change of one experiment's mechanics, row by row.

    Attributes
    ----------
    wrench : (n, 6) N, N·m
    fiducials : (n, m, 3) m
    motion : (n, 6) translation (m) and rotation vector (rad) of the gripper
    """

    wrench: FloatArray
    fiducials: FloatArray
    motion: FloatArray


def filled(solution: Solution, change: MechanicalChange) -> MechanicalChange:
    """Return a change that is known at the first rows of the solved load steps at all rows."""
    if solution.between is not None:
        of_row = solution.load_steps.of_row
        first = np.searchsorted(of_row, solution.solved)
        both = (change.wrench, change.fiducials)
        wrench, fiducials = (solution.filled(known[first])[of_row] for known in both)
        change = replace(change, wrench=wrench, fiducials=fiducials)
    return change


def no_change(solution: Solution) -> MechanicalChange:
    """Return a change of nothing yet."""
    rows, beads = len(solution.load_steps.of_row), len(solution.problem.fiducials_rest)
    return MechanicalChange(np.zeros((rows, 6)), np.zeros((rows, beads, 3)), np.zeros((rows, 6)))
