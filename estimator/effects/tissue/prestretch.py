"""The phantom was mounted under tension; the sensor's zero hides its force."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.effects.blocks import Group
from estimator.effects.effect import Amplitude, Effect, Motion, Readings, Values
from estimator.effects.shared.sensor_steps import SensorStep, zero_of_beads, zero_of_wrench
from estimator.effects.shared.zeroing import ZeroAxes, with_fiducials_zeroed, with_wrench_zeroed
from estimator.effects.stages import Hook, Stage
from estimator.experiment import Experiment
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.morph import with_beads_before, with_beads_before_drawing, with_grasp_drawn
from estimator.fem.terms.swelling import Swelling
from estimator.fem.terms.term import Term
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]
Direction = Literal["along", "aside"]


_SHRUNK = Amplitude("shrunk", "1", scale=0.015, smallest=1e-3, lower=-0.1, upper=0.1)


class _Tension(Effect):
    label: ClassVar[str] = "prestretch"
    group: ClassVar[Group] = "geometry"
    stage: ClassVar[Stage] = "tissue"
    acts_on: ClassVar[tuple[Hook, ...]] = ("problem", "readings")
    words: ClassVar[str] = "The phantom was mounted under tension, whose force the sensor's zero hides."


class Prestretch(_Tension):
    """The grasp was drawn away from the anchors when the phantom was mounted.

    The stated shape and the beads' rest positions are those of the mounted phantom. Free of stress, its grasped region
    lies back by the amplitude, and the tissue between it and the borders follows. The gripper's reported pose is
    true; in the first row the tissue is already stretched.
    """

    def __init__(self, form: str, directions: tuple[Direction, ...], zero_axes: ZeroAxes = "gripper") -> None:
        self.form = form
        self.amplitudes = tuple(_DRAWN[direction] for direction in directions)
        self._zero_axes = zero_axes

    def problem(self, problem: RetractionProblem, values: Values) -> RetractionProblem:
        """Draw the grasped region back to where it is free of stress."""
        if not any(values.values()):
            return problem
        along = _from_anchors(problem)
        aside = np.array([-along[1], along[0]])
        drawn = values.get("along", 0.0) * along + values.get("aside", 0.0) * aside
        back = with_grasp_drawn(problem, -drawn)
        return replace(back, grasp_centre=problem.grasp_centre - [*drawn, 0.0])

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Take the sensor's zero, and the beads' motion from the mounted state."""
        if not any(values.values()):
            return readings
        return with_fiducials_zeroed(with_wrench_zeroed(readings, self._zero_axes))

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the zeros."""
        return (zero_of_wrench(self._zero_axes), zero_of_beads()) if any(values.values()) else ()


class DrawnFromStatedShape(_Tension):
    """The same, with shape and rest positions as they were measured before mounting.

    The gripper is further from the free tissue than it reports by the amplitudes, and the beads show that already in
    the first row.
    """

    acts_on: ClassVar[tuple[Hook, ...]] = ("motion", "readings")
    form = "beads_known_before"
    amplitudes = tuple(
        Amplitude(f"drawn_{axis}", "m", scale=1e-3, smallest=1e-4, lower=-0.02, upper=0.02) for axis in "xy"
    )

    def motion(self, motion: Motion, values: Values) -> Motion:
        """Add where the gripper was drawn to."""
        if not any(values.values()):
            return motion
        return motion.moved(motion.position + np.array([values["drawn_x"], values["drawn_y"], 0.0]))

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Take the sensor's zero."""
        return with_wrench_zeroed(readings) if any(values.values()) else readings

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the zero."""
        return (zero_of_wrench("gripper"),) if any(values.values()) else ()


class DrawnBeforeBeadsWereMeasured(DrawnFromStatedShape):
    """The same, with the beads' rest positions as they were measured after mounting.

    The beads show no stretch then, but they sit on tissue that lay elsewhere before it was drawn.
    """

    acts_on = ("problem", "motion", "readings")
    form = "beads_known_after"
    rest_seen = True

    def problem(self, problem: RetractionProblem, values: Values) -> RetractionProblem:
        """Put the beads where they were before the tissue was drawn."""
        if not any(values.values()):
            return problem
        return with_beads_before_drawing(problem, np.array([values["drawn_x"], values["drawn_y"]]))

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Take the sensor's zero, and the beads' motion from the mounted state."""
        zeroed = super().readings(readings, values)
        return with_fiducials_zeroed(zeroed) if any(values.values()) else readings

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the zeros."""
        zero = super().sensor_steps(experiment, values)
        return (*zero, zero_of_beads()) if zero else ()


class ShrunkInPlace(_Tension):
    """The tissue has shrunk, or swollen, alike in all directions between anchors and jaws once it was mounted.

    As it dries, cures or cools its natural size changes by the strain: a sheet is drawn in its plane and free to change
    its thickness. The stated shape is that before; beads were seen, and the sensor was zeroed, after.
    """

    acts_on = ("beads", "terms", "readings")
    form = "shrunk_in_place"
    elaborates = "along"
    rest_seen = True
    amplitudes = (_SHRUNK,)

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Change the tissue's natural size."""
        if not values[_SHRUNK.name]:
            return ()
        return (Swelling.by_strain(problem.body, material, -values[_SHRUNK.name]),)

    def beads(self, problem: RetractionProblem, at_rest: FloatArray, values: Values) -> RetractionProblem:
        """Put the beads where they were before the tissue shrank."""
        if not values[_SHRUNK.name]:
            return problem
        return with_beads_before(problem, at_rest, GripperPose(problem.grasp_centre, Rotation.identity()))

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Take the sensor's zero, and the beads' motion from the mounted state."""
        return with_fiducials_zeroed(with_wrench_zeroed(readings)) if values[_SHRUNK.name] else readings

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return the zeros."""
        return (zero_of_wrench("gripper"), zero_of_beads()) if values[_SHRUNK.name] else ()


def _from_anchors(problem: RetractionProblem) -> FloatArray:
    """Return the direction (2,) in the plane from the middle of the anchored nodes to the grasp.

    It is x where the grasp lies above them, and where rollers alone hold the tissue.
    """
    if not problem.anchored.any():
        return np.array([1.0, 0.0])
    anchored = problem.body.mesh.points[problem.anchored]
    away = problem.grasp_centre - (anchored.min(axis=0) + anchored.max(axis=0)) / 2
    length = np.linalg.norm(away[:2])
    return np.asarray(away[:2] / length) if length > 0.0 else np.array([1.0, 0.0])


_DRAWN: dict[Direction, Amplitude] = {
    "along": Amplitude("along", "m", scale=1.5e-3, smallest=1e-4, lower=0.0, upper=0.02),
    "aside": Amplitude("aside", "m", scale=1e-3, smallest=1e-4, lower=-0.02, upper=0.02),
}
PRESTRETCH = (
    Prestretch("along", ("along",)),
    Prestretch("along_and_aside", ("along", "aside")),
    DrawnFromStatedShape(),
    DrawnBeforeBeadsWereMeasured(),
    ShrunkInPlace(),
)
