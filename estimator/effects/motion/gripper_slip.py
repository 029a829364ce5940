"""The tissue slides in the gripper under load, and does not slide back."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.effects.effect import Amplitude, Constant, Effect, Motion, Readings, Values
from estimator.effects.shared.axes import AXES
from estimator.effects.shared.misfit import measured_or_predicted
from estimator.effects.shared.sensor_steps import SensorStep
from estimator.experiment import Experiment

FloatArray = NDArray[np.float64]

_THRESHOLD = Constant("threshold", "N", (), 0.02, 200.0)
# Shares of the largest measured force: where the tissue slides freely, the threshold is that force.
_TRIED_THRESHOLDS = (0.4, 0.6, 0.75, 0.87, 0.94, 1.0)
# Loads that differ by less than this share of the largest are one level.
_ONE_LEVEL = 1e-3
# A jump is seen between two stations of the gripper, of which there are some tens on its way out.
_THRESHOLDS_TOLD_APART = 30


class GripperSlip(Effect):
    """Slip s = c · max over the past of (|F| − threshold), in the gripper frame, along the load at that moment.

    Coulomb friction whose threshold hardens by h per metre slipped, in series with tissue of stiffness k, lets the
    load follow threshold + h s: hardly more than the threshold where h is small, so that the measured load cannot
    tell the slip. F is therefore the load that would act had the tissue not slid (the trial load of a return
    mapping; Simo & Hughes 1998, Computational Inelasticity, chapter 1), for which c = 1/(k + h).
    """

    label = "gripper_slip"
    group = "grasp"
    stage = "motion"
    acts_on = ("motion", "readings")
    words = "The tissue slides in the gripper under load and stays there."
    form = "gradual"
    amplitudes: tuple[Amplitude, ...] = (
        Amplitude("slip_per_force", "m/N", scale=0.01, smallest=5e-4, lower=0.0),
    )
    constants: tuple[Constant, ...] = (_THRESHOLD,)

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return thresholds from far below the largest measured force up to it."""
        loads = [measured_or_predicted(each)[:, :3] for each in baseline]
        largest = max(float(np.quantile(np.linalg.norm(load, axis=1), 0.95)) for load in loads)
        return [{"threshold": share * largest} for share in _TRIED_THRESHOLDS]

    def motion(self, motion: Motion, values: Values) -> Motion:
        """Leave the tissue behind by what it has slid."""
        slip = _along_load(motion, self._slipped(motion, values))
        return motion.moved(motion.position + motion.rotation.apply(slip))

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Refer the torque to the gripper's reported origin: the sensor has not slid."""
        arm = readings.position - readings.reported_position
        wrench = readings.wrench.copy()
        wrench[:, 3:] += np.cross(arm, wrench[:, :3])
        return readings.with_wrench(wrench)

    def sensor_steps(self, experiment: Experiment, values: Values) -> tuple[SensorStep, ...]:
        """Return that torques are about the reported origin."""
        return ({"kind": "torque_about_reported_origin"},)

    def _slipped(self, motion: Motion, values: Values) -> FloatArray:
        """Return the length slipped (n,), m, which never falls."""
        return np.asarray(values["slip_per_force"] * np.maximum.accumulate(_excess(motion, values)))


class CreepingSlip(GripperSlip):
    """The same against a drag as well, and in proportion to any power of what pulls beyond the threshold.

    The drag η adds to what hardens: (k + h) s + η ds/dt = |F| − threshold, so that the slip nears what it would be
    without drag with the time constant η/(k + h) (P. Perzyna, Adv. Appl. Mech. 9 (1966) 243, in one dimension): it
    lags, and goes on in a hold. Without drag it is

        s = c · threshold · (max (|F| − threshold) / threshold)^p

    which with p < 1 starts all but at once and then catches, as where jaws hold by a rim, and with p > 1 sets in
    gradually, as where one place of the jaws after another lets go.
    """

    form = "creeping"
    elaborates = "gradual"
    rate_dependent = True
    constants = (
        _THRESHOLD,
        Constant("time_constant", "s", (1.0, 5.0), lower=0.05, upper=500.0),
        Constant("power", "1", (1.0,), lower=0.3, upper=3.0),
    )

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return the same thresholds, with every time constant and power of the grid."""
        _, times, powers = (constant.grid for constant in self.constants)
        return [
            {**start, "time_constant": time, "power": power}
            for start in super().starts(baseline)
            for time in times
            for power in powers
        ]

    def _slipped(self, motion: Motion, values: Values) -> FloatArray:
        threshold = values["threshold"]
        to_be = (
            values["slip_per_force"] * threshold * (_excess(motion, values) / threshold) ** values["power"]
        )
        reached = -np.expm1(-np.diff(motion.time, prepend=motion.time[0]) / values["time_constant"])
        slipped = np.zeros_like(to_be)
        for n in range(1, len(to_be)):
            slipped[n] = slipped[n - 1] + max(to_be[n] - slipped[n - 1], 0.0) * reached[n]
        return slipped


class SlipByAxis(GripperSlip):
    """The jaws let the tissue slide more easily along some of their axes, and turn in them.

    Along each axis of the gripper it slides by its own c, and it turns about the present torque by an angle for each
    newton beyond the threshold: jaws that are open at one end, or grooved, or that hold by their tips.
    """

    form = "by_axis"
    elaborates = "gradual"
    amplitudes = (
        *(Amplitude(f"slip_per_force_{axis}", "m/N", scale=0.01, smallest=5e-4, lower=0.0) for axis in AXES),
        Amplitude("turn_per_force", "rad/N", scale=0.2, smallest=0.01, lower=0.0),
    )

    def motion(self, motion: Motion, values: Values) -> Motion:
        """Leave the tissue behind by what it has slid along each axis, and by what it has turned."""
        excess = np.maximum.accumulate(_excess(motion, values))
        by_axis = np.array([values[f"slip_per_force_{axis}"] for axis in AXES])
        slip = by_axis * _along_load(motion, excess)
        turn = _along(motion.rotation.inv().apply(motion.load[:, 3:]), values["turn_per_force"] * excess)
        position = motion.position + motion.rotation.apply(slip)
        return motion.moved(position, motion.rotation * Rotation.from_rotvec(turn))


class GripperJump(GripperSlip):
    """The tissue slides all at once when the load first passes the threshold, and then holds."""

    form = "jump"
    constants = (replace(_THRESHOLD, fixed=True),)
    amplitudes = (Amplitude("slip", "m", scale=1.5e-3, smallest=1e-4, lower=0.0),)

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return a threshold between every two levels to which the load rises: each lets another station slip first."""
        loads = [np.linalg.norm(each.wrench[:, :3], axis=1) for each in baseline]
        levels = np.unique(np.concatenate([np.maximum.accumulate(load) for load in loads]))
        apart = np.diff(levels) > _ONE_LEVEL * levels[-1]
        return [{"threshold": float(middle)} for middle in (levels[1:] + levels[:-1])[apart] / 2]

    def choices(self, experiments: Sequence[Experiment]) -> int:
        """Return the number of thresholds that differ in what they do."""
        return _THRESHOLDS_TOLD_APART

    def _slipped(self, motion: Motion, values: Values) -> FloatArray:
        return np.asarray(values["slip"] * np.maximum.accumulate(_excess(motion, values) > 0.0))


def _along_load(motion: Motion, slipped: FloatArray) -> FloatArray:
    """Return the slip (n, 3) in the gripper's axes, each piece of its length (n,) along the load at that moment."""
    return _along(motion.rotation.inv().apply(motion.load[:, :3]), slipped)


def _along(vectors: FloatArray, length: FloatArray) -> FloatArray:
    """Return the sum (n, 3) of the pieces of a length (n,), each along its vector of (n, 3)."""
    direction = vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300)
    return np.cumsum(np.diff(length, prepend=0.0)[:, None] * direction, axis=0)


def _excess(motion: Motion, values: Values) -> FloatArray:
    """Return how far the trial load is beyond the threshold (n,), N."""
    return np.maximum(np.linalg.norm(motion.trial[:, :3], axis=1) - values["threshold"], 0.0)
