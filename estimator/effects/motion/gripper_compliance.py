"""Gripper or arm yields elastically between the reported pose and the tissue."""

import numpy as np
from scipy.spatial.transform import Rotation

from estimator.effects.effect import Amplitude, Effect, Motion, Values
from estimator.effects.shared.axes import AXES

_COMPLIANCE_SCALE = 5e-4
_COMPLIANCE_SMALLEST = 2e-5


class GripperCompliance(Effect):
    """True position = reported position + C F: the tissue pulls the gripper after it, alike in all directions."""

    label = "gripper_compliance"
    group = "grasp"
    stage = "motion"
    acts_on = ("motion",)
    words = "Gripper or arm yields elastically under the tissue's pull."
    form = "translation"
    amplitudes: tuple[Amplitude, ...] = (
        Amplitude("compliance", "m/N", _COMPLIANCE_SCALE, _COMPLIANCE_SMALLEST, lower=0.0),
    )

    def motion(self, motion: Motion, values: Values) -> Motion:
        """Let the gripper yield to the force."""
        return motion.moved(motion.position + values["compliance"] * motion.load[:, :3])


class AxisCompliance(GripperCompliance):
    """Each axis of the gripper yields by its own compliance: C = R diag(c) Rᵀ."""

    form = "by_axis"
    amplitudes = tuple(
        Amplitude(f"compliance_{axis}", "m/N", _COMPLIANCE_SCALE, _COMPLIANCE_SMALLEST, lower=0.0)
        for axis in AXES
    )

    def motion(self, motion: Motion, values: Values) -> Motion:
        """Let the gripper yield to the force along each of its axes."""
        compliance = np.array([values[f"compliance_{axis}"] for axis in AXES])
        force = motion.rotation.inv().apply(motion.load[:, :3])
        return motion.moved(motion.position + motion.rotation.apply(compliance * force))


_OF_ROTATION = Amplitude("rotation_compliance", "rad/(N·m)", scale=1.0, smallest=0.05, lower=0.0)


def _turned(yielding: Motion, reported: Motion, values: Values) -> Motion:
    """Turn the gripper under the torque about its origin: true rotation = exp(C_r T) times the reported one."""
    turn = Rotation.from_rotvec(values[_OF_ROTATION.name] * reported.load[:, 3:])
    return yielding.moved(yielding.position, turn * reported.rotation)


class RotationCompliance(GripperCompliance):
    """The gripper yields alike in all directions, and turns under the torque."""

    form = "translation_and_rotation"
    amplitudes = (*GripperCompliance.amplitudes, _OF_ROTATION)

    def motion(self, motion: Motion, values: Values) -> Motion:
        """Let the gripper yield to force and torque."""
        return _turned(super().motion(motion, values), motion, values)


class AxisAndRotationCompliance(AxisCompliance):
    """Each axis of the gripper yields by its own compliance, and the gripper turns under the torque."""

    form = "by_axis_and_rotation"
    elaborates = "by_axis"
    amplitudes = (*AxisCompliance.amplitudes, _OF_ROTATION)

    def motion(self, motion: Motion, values: Values) -> Motion:
        """Let the gripper yield to force and torque."""
        return _turned(super().motion(motion, values), motion, values)
