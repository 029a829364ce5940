"""The tissue slides in the gripper under load, and does not slide back."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import Amplitude, Constant, Effect, Motion, Readings, Values

FloatArray = NDArray[np.float64]

_THRESHOLD = Constant("threshold", "N", (), 0.02, 200.0)
# Shares of the largest measured force: where the tissue slides freely, the threshold is that force.
_TRIED_THRESHOLDS = (0.4, 0.6, 0.75, 0.87, 0.94, 1.0)


class GripperSlip(Effect):
    """Slip s = c · max over the past of (|F| − threshold), in the gripper frame, along the load at that moment.

    Coulomb friction whose threshold hardens by h per metre slipped, in series with tissue of stiffness k, lets the
    load follow threshold + h s: hardly more than the threshold where h is small, so that the measured load cannot
    tell the slip. F is therefore the load that would act had the tissue not slid (the trial load of a return
    mapping; Simo & Hughes 1998, Computational Inelasticity, chapter 1), for which c = 1/(k + h).
    """

    label = "gripper_slip"
    group = "grasp"
    words = "The tissue slides in the gripper under load and stays there."
    form = "gradual"
    amplitudes: tuple[Amplitude, ...] = (
        Amplitude("slip_per_force", "m/N", scale=0.01, smallest=5e-4, lower=0.0),
    )
    constants = (_THRESHOLD,)

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return thresholds from far below the largest measured force up to it."""
        loads = [each.experiment.wrench[:, :3] for each in baseline]
        largest = max(float(np.nanquantile(np.linalg.norm(load, axis=1), 0.95)) for load in loads)
        return [{"threshold": share * largest} for share in _TRIED_THRESHOLDS]

    def motion(self, motion: Motion, values: Values) -> Motion:
        """Leave the tissue behind by what it has slid."""
        slipped = self._slipped(np.linalg.norm(motion.trial[:, :3], axis=1) - values["threshold"], values)
        force = motion.rotation.inv().apply(motion.load[:, :3])
        direction = force / np.maximum(np.linalg.norm(force, axis=1, keepdims=True), 1e-300)
        slip = np.cumsum(np.diff(slipped, prepend=0.0)[:, None] * direction, axis=0)
        return motion.moved(motion.position + motion.rotation.apply(slip))

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Refer the torque to the gripper's reported origin: the sensor has not slid."""
        arm = readings.position - readings.reported_position
        wrench = readings.wrench.copy()
        wrench[:, 3:] += np.cross(arm, wrench[:, :3])
        return readings.with_wrench(wrench)

    def _slipped(self, excess: FloatArray, values: Values) -> FloatArray:
        """Return the length slipped (n,), m, which never falls."""
        return values["slip_per_force"] * np.maximum.accumulate(np.maximum(excess, 0.0))


class GripperJump(GripperSlip):
    """The tissue slides all at once when the load first passes the threshold, and then holds."""

    form = "jump"
    constants = (replace(_THRESHOLD, fixed=True),)
    amplitudes = (Amplitude("slip", "m", scale=1.5e-3, smallest=1e-4, lower=0.0),)

    def _slipped(self, excess: FloatArray, values: Values) -> FloatArray:
        return values["slip"] * np.maximum.accumulate((excess > 0.0).astype(np.float64))
