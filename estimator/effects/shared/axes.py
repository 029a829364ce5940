"""Wrenches between tissue axes and the axes of the gripper, in which the sensor sits."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

FloatArray = NDArray[np.float64]

AXES: tuple[str, ...] = ("x", "y", "z")
WRENCH_CHANNELS: tuple[str, ...] = ("fx", "fy", "fz", "tx", "ty", "tz")


def turned(rotation: Rotation, wrench: FloatArray) -> FloatArray:
    """Return force and torque, each turned: wrench (n, 6) or (6,), by n rotations or one, (n, 6)."""
    return np.concatenate([rotation.apply(wrench[..., :3]), rotation.apply(wrench[..., 3:])], axis=-1)


def in_gripper_axes(rotation: Rotation, wrench: FloatArray) -> FloatArray:
    """Return a wrench (n, 6) given in tissue axes, in the axes of the gripper that ``rotation`` turns."""
    return turned(rotation.inv(), wrench)


def in_tissue_axes(rotation: Rotation, wrench: FloatArray) -> FloatArray:
    """Return a wrench (n, 6) or (6,) given in the gripper's axes, in tissue axes, (n, 6)."""
    return turned(rotation, wrench)
