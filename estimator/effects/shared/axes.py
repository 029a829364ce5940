"""Wrenches between tissue axes and the axes of the gripper, in which the sensor sits."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

FloatArray = NDArray[np.float64]

AXES: tuple[str, ...] = ("x", "y", "z")
WRENCH_CHANNELS: tuple[str, ...] = ("fx", "fy", "fz", "tx", "ty", "tz")
# In which something is constant: a sensor's own error turns with the gripper, what software adds after it has turned
# the wrench into the tissue's axes does not.
Frame = Literal["sensor", "tissue"]


def turned(rotation: Rotation, wrench: FloatArray) -> FloatArray:
    """Return force and torque, each turned: wrench (n, 6) or (6,), by n rotations or one, (n, 6)."""
    return np.concatenate([rotation.apply(wrench[..., :3]), rotation.apply(wrench[..., 3:])], axis=-1)


def in_gripper_axes(rotation: Rotation, wrench: FloatArray) -> FloatArray:
    """Return a wrench (n, 6) given in tissue axes, in the axes of the gripper that ``rotation`` turns."""
    return turned(rotation.inv(), wrench)


def in_tissue_axes(rotation: Rotation, wrench: FloatArray) -> FloatArray:
    """Return a wrench (n, 6) or (6,) given in the gripper's axes, in tissue axes, (n, 6)."""
    return turned(rotation, wrench)


def changed_in(frame: Frame, rotation: Rotation, wrench: FloatArray, matrix: FloatArray) -> FloatArray:
    """Return a wrench (n, 6) in tissue axes with matrix (6, 6) times it added, in the axes of a frame."""
    if frame == "tissue":
        return wrench + wrench @ matrix.T
    return wrench + in_tissue_axes(rotation, in_gripper_axes(rotation, wrench) @ matrix.T)
