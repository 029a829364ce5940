"""Air is caught below the tissue: no label of the catalogue."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import OUTSIDE, Amplitude, Constant, Effect, Readings, Values
from estimator.effects.places import CENTRE, belonging, places_of
from estimator.effects.support_friction import area_on_table
from estimator.effects.zeroing import with_fiducials_zeroed, with_wrench_zeroed
from estimator.experiment import Experiment
from estimator.fem.cushion import Cushion
from estimator.fem.problem import RetractionProblem
from estimator.fem.terms import Term
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

_PRESSURE = Amplitude("pressure_over_modulus", "1", scale=3e-3, smallest=1e-4, lower=0.0, upper=0.2)
_RADIUS = Constant("radius", "m", (0.012,), lower=0.004, upper=0.04)
_HEIGHT = Constant("height", "m", (0.001,), lower=1e-4, upper=0.01)


class AirPocket(Effect):
    """A bubble pushes the underside up within a circle: its pressure, times Young's modulus, falls to none at a height.

    It was there when the phantom was mounted: the sensor was zeroed and the beads' rest positions were measured with
    it. It stays where it is while the tissue moves over it.
    """

    label = OUTSIDE
    group = "environment"
    words = "Air is caught below the tissue and pushes it up."
    form = "air_pocket"
    mistaken_for = ("inhomogeneity", "thickness_error", "gravity_sag", "modulus_gradient")
    amplitudes = (_PRESSURE,)
    constants = (*CENTRE, _RADIUS, _HEIGHT)

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return the grid, spread over the phantom's edges, without the places inside the grasp."""
        return places_of(baseline[0].experiment, super().starts(baseline))

    def place(self, problem: RetractionProblem, values: Values) -> tuple[FloatArray, float] | None:
        """Return the pocket's centre and radius."""
        below = float(problem.body.mesh.points[:, 2].min())
        return np.array([values["centre_x"], values["centre_y"], below]), values[_RADIUS.name]

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Push the nodes of the underside within the pocket."""
        if not values[_PRESSURE.name]:
            return ()
        area = area_on_table(problem)
        centre = np.array([values["centre_x"], values["centre_y"]])
        depth = values[_RADIUS.name] - np.linalg.norm(problem.body.mesh.points[:, :2] - centre, axis=1)
        pressure = values[_PRESSURE.name] * material.youngs_modulus
        springs = pressure / values[_HEIGHT.name] * area * belonging(depth, np.sqrt(area))
        return (Cushion(springs, values[_HEIGHT.name]),)

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Take the sensor's zero, and the beads' motion from the mounted state."""
        if not values[_PRESSURE.name]:
            return readings
        return with_fiducials_zeroed(with_wrench_zeroed(readings))
