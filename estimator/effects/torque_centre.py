"""Torques are about another point than stated."""

import numpy as np

from estimator.effects.axes import AXES
from estimator.effects.effect import Amplitude, Effect, Readings, Values


class TorqueCentre(Effect):
    """Torques are about the point d of the gripper frame, not about its origin: T' = T − (R d) × F."""

    label = "torque_centre"
    group = "force"
    words = "Torques are about another point than the stated origin of the gripper frame."
    amplitudes = tuple(Amplitude(f"centre_{axis}", "m", scale=4e-3, smallest=5e-4) for axis in AXES)

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Move the torques to the other point."""
        centre = np.array([values[amplitude.name] for amplitude in self.amplitudes])
        wrench = readings.wrench.copy()
        wrench[:, 3:] -= np.cross(readings.rotation.apply(centre), wrench[:, :3])
        return readings.with_wrench(wrench)
