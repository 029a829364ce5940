"""A model's answer to a retraction for every E and ν, from solutions at some ν.

Under a prescribed motion the displacements of a Neo-Hookean body do not depend on E, and its forces are proportional to
it. Along −ln(1 − 2ν), in which the answer is smooth up to incompressibility, it is interpolated by cubic splines.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.forward.model import ForwardModel
from estimator.materials import NeoHookean
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

RATIOS = (-0.06, 0.0, 0.1, 0.19, 0.26, 0.32, 0.37, 0.41, 0.44, 0.462, 0.478, 0.488, 0.4945, 0.498, 0.4995)
_UNIT_PA = 1e4


@dataclass(frozen=True, eq=False)
class UnitResponse:
    """Answers at some ν, ascending, without the first row, from which displacements and forces count.

    Attributes
    ----------
    ratios : (s,) ν that were solved
    moved, force : (s, r, m, 3), m, and (s, r, 3) for each Pa of E, N/Pa
    seconds : that the solutions took
    """

    ratios: FloatArray
    moved: FloatArray
    force: FloatArray
    seconds: float = 0.0

    def at(self, ratio: FloatArray | float) -> tuple[FloatArray, FloatArray]:
        """Return displacements (..., r·m·3), m, and forces (..., r·3), N/Pa, at ν within those solved."""
        x = -np.log1p(-2 * np.asarray(ratio))
        return np.asarray(self._moved(x)), np.asarray(self._force(x))

    @cached_property
    def _moved(self) -> CubicSpline:
        return self._along(self.moved)

    @cached_property
    def _force(self) -> CubicSpline:
        return self._along(self.force)

    def _along(self, values: FloatArray) -> CubicSpline:
        return CubicSpline(-np.log1p(-2 * self.ratios), values.reshape(len(values), -1))


def solve_response(
    problem: RetractionProblem, planned: Experiment, ratios: Sequence[float] = RATIOS
) -> UnitResponse:
    """Solve a retraction whose every row is another pose, at some ν.

    Raises
    ------
    SolverError
        The motion has no equilibrium.
    """
    began = time.perf_counter()
    model = ForwardModel(problem, [planned])
    states = [int(state) for state in model.schedules[0].state_of_row]
    moved, force = [], []
    for ratio in ratios:
        seen = model.predict(Material(NeoHookean(), _UNIT_PA, ratio), [sorted(set(states))])[0]
        first = seen[states[0]]
        moved.append([seen[state].fiducials - first.fiducials for state in states[1:]])
        force.append([(seen[state].wrench[:3] - first.wrench[:3]) / _UNIT_PA for state in states[1:]])
    return UnitResponse(np.array(ratios), np.array(moved), np.array(force), time.perf_counter() - began)
