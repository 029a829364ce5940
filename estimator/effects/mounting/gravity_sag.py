"""The phantom hangs free and sags under its weight."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.effects.blocks import Group
from estimator.effects.effect import Amplitude, Constant, Effect, Readings, Values
from estimator.effects.shared.on_table import area_on_table
from estimator.effects.shared.sensor_steps import SensorStep, zero_of_beads, zero_of_wrench
from estimator.effects.shared.zeroing import with_fiducials_zeroed, with_wrench_zeroed
from estimator.effects.stages import Hook, Stage
from estimator.experiment import Experiment
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.shares import nodal_weights
from estimator.fem.equilibrium.morph import with_beads_before
from estimator.fem.terms.cushion import Cushion
from estimator.fem.terms.steady import DeadLoad
from estimator.fem.terms.term import Term
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

_WEIGHT = Amplitude("weight", "1", scale=0.7, smallest=0.02, lower=0.0, upper=1.5)
# From a film over water to a firm rubber: a layer of modulus E' and height h has about E'/h. A sheet of 10 mm sinks by
# 10 and by 1 mm.
_BED = Constant("bed_stiffness", "Pa/m", (1e4, 1e5), lower=1e3, upper=1e7)


class GravitySag(Effect):
    """The weight of the tissue acts and no table carries it; 1 is its full weight.

    The sensor was zeroed in the first row with the tissue hanging. The beads' stated rest positions are those on the
    undeformed phantom, or those that were seen when it hung: then they sit on tissue that lies elsewhere undeformed.
    Where an experiment states that the weight acts it is in the model, and nothing is left of this effect.
    """

    label: ClassVar[str] = "gravity_sag"
    group: ClassVar[Group] = "environment"
    stage: ClassVar[Stage] = "surroundings"
    acts_on: ClassVar[tuple[Hook, ...]] = ("beads", "terms", "readings")
    words: ClassVar[str] = "The phantom hangs free and sags under its weight."
    amplitudes = (_WEIGHT,)

    def __init__(self, form: str, beads: Literal["undeformed", "hanging"]) -> None:
        self.form = form
        self.rest_seen = beads == "hanging"

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Let the weight act on every node."""
        if not values["weight"] or problem.heavy:
            return ()
        full = experiment.phantom.density * np.asarray(experiment.environment.gravity)
        return (DeadLoad(nodal_weights(problem.body.mesh, values["weight"] * full)),)

    def beads(self, problem: RetractionProblem, at_rest: FloatArray, values: Values) -> RetractionProblem:
        """Put beads that were seen when the tissue hung on the tissue that hung there."""
        if not self.rest_seen or not values["weight"] or problem.heavy:
            return problem
        rest_pose = GripperPose(problem.grasp_centre, Rotation.identity())
        return with_beads_before(problem, at_rest, rest_pose)

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Take the sensor's zero."""
        if not values["weight"] or readings.experiment.specific_weight.any():
            return readings
        zeroed = with_wrench_zeroed(readings)
        return with_fiducials_zeroed(zeroed) if self.rest_seen else zeroed

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the zeros."""
        if not values["weight"]:
            return ()
        zero = zero_of_wrench("gripper")
        return (zero, zero_of_beads()) if self.rest_seen else (zero,)


class SagOnSoftBed(GravitySag):
    """The tissue lies on a smooth bed that is soft enough for it to sink in: foam, gel, a net.

    The bed pushes the underside up by k per area and depth to which it has sunk below its undeformed place, and never
    pulls (E. Winkler, "Die Lehre von der Elasticitaet und Festigkeit", 1867, section 195). Its push grows with the
    share w of the weight, as w k, so that a little weight does little: k is the bed's own where all of the weight acts.
    """

    needs_table: ClassVar[bool] = True
    constants = (_BED,)

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Let the weight act on every node, and the bed on those of the underside."""
        weight = super().terms(problem, material, experiment, values)
        if not weight:
            return ()
        stiffness = values["weight"] * values[_BED.name]
        return (*weight, Cushion(stiffness * area_on_table(problem), 0.0))


GRAVITY_SAG = (
    GravitySag("beads_undeformed", "undeformed"),
    GravitySag("beads_hanging", "hanging"),
    SagOnSoftBed("on_soft_bed", "undeformed"),
    SagOnSoftBed("on_soft_bed_beads_lying", "hanging"),
)
