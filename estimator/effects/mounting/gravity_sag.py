"""The phantom hangs free and sags under its weight."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.effects.blocks import Group
from estimator.effects.effect import Amplitude, Effect, Readings, Values
from estimator.effects.shared.sensor_steps import SensorStep, zero_of_beads, zero_of_wrench
from estimator.effects.shared.zeroing import with_fiducials_zeroed, with_wrench_zeroed
from estimator.effects.stages import Hook, Stage
from estimator.experiment import Experiment
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.shares import nodal_weights
from estimator.fem.equilibrium.morph import with_beads_before
from estimator.fem.terms.steady import DeadLoad
from estimator.fem.terms.term import Term
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

_WEIGHT = Amplitude("weight", "1", scale=0.7, smallest=0.02, lower=0.0, upper=1.5)


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


GRAVITY_SAG = (
    GravitySag("beads_undeformed", "undeformed"),
    GravitySag("beads_hanging", "hanging"),
)
