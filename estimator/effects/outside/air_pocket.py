"""Air is caught below the tissue: no label of the catalogue."""

from __future__ import annotations

from estimator.effects.effect import OUTSIDE, Amplitude, Constant, Readings, Values
from estimator.effects.mounting.gravity_sag import GravitySag
from estimator.effects.shared.on_table import OnTable, area_within
from estimator.effects.shared.places import CENTRE
from estimator.effects.shared.zeroing import with_fiducials_zeroed, with_wrench_zeroed
from estimator.effects.tissue.inhomogeneity import Inhomogeneity
from estimator.effects.tissue.modulus_gradient import ModulusGradient
from estimator.effects.tissue.thickness_error import ThicknessError
from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.terms.cushion import Cushion
from estimator.fem.terms.term import Term
from estimator.materials.material import Material

_PRESSURE = Amplitude("pressure_over_modulus", "1", scale=3e-3, smallest=1e-4, lower=0.0, upper=0.2)
_RADIUS = Constant("radius", "m", (0.012,), lower=0.004, upper=0.04)
_HEIGHT = Constant("height", "m", (0.001,), lower=1e-4, upper=0.01)


class AirPocket(OnTable):
    """A bubble pushes the underside up within a circle: its pressure, times Young's modulus, falls to none at a height.

    It was there when the phantom was mounted: the sensor was zeroed and the beads' rest positions were measured with
    it. It stays where it is while the tissue moves over it.
    """

    label = OUTSIDE
    group = "environment"
    stage = "surroundings"
    acts_on = ("terms", "readings")
    words = "Air is caught below the tissue and pushes it up."
    form = "air_pocket"
    mistaken_for = (Inhomogeneity.label, ThicknessError.label, GravitySag.label, ModulusGradient.label)
    amplitudes = (_PRESSURE,)
    constants = (*CENTRE, _RADIUS, _HEIGHT)

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Push the nodes of the underside within the pocket."""
        if not values[_PRESSURE.name]:
            return ()
        pressure = values[_PRESSURE.name] * material.youngs_modulus
        springs = pressure / values[_HEIGHT.name] * area_within(problem, values)
        return (Cushion(springs, values[_HEIGHT.name]),)

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Take the sensor's zero, and the beads' motion from the mounted state."""
        if not values[_PRESSURE.name]:
            return readings
        return with_fiducials_zeroed(with_wrench_zeroed(readings))
