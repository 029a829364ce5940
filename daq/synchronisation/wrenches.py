"""From what the force sensor reads to what the tissue exerts on the gripper.

The sensor reads the load that its environment puts on the tool: its offset, the weight of the tool, and the tissue.
The reading at rest holds offset and weight at the rest orientation; what the weight changes by as the gripper turns
is computed from the tool's mass and centre of mass.
"""

from dataclasses import dataclass

import numpy as np

from daq.frames import rotation, transform_wrench
from daq.rig import Tool
from robot_drivers.protocols import FloatArray, Pose


@dataclass(frozen=True, slots=True)
class WrenchCompensation:
    """Zeroes, compensates and turns readings.

    Attributes
    ----------
    rest_reading : (6,) mean reading at rest, sensor frame
    rest_quaternion_wxyz : (4,) orientation of the gripper in the tissue frame at rest
    T_gripper_sensor : pose of the sensor in the gripper frame
    tool : what hangs on the sensor
    gravity : (3,) m/s², tissue frame
    """

    rest_reading: FloatArray
    rest_quaternion_wxyz: FloatArray
    T_gripper_sensor: Pose
    tool: Tool
    gravity: tuple[float, float, float]

    def tissue_wrench(self, readings: FloatArray, quaternion_wxyz: FloatArray) -> FloatArray:
        """Return the wrench of the tissue on the gripper, N and N·m.

        Parameters
        ----------
        readings : (..., 6) in the sensor frame, all at one orientation
        quaternion_wxyz : (4,) orientation of the gripper in the tissue frame

        Returns
        -------
        (..., 6) axes of the tissue frame, torque about the gripper's origin
        """
        load = transform_wrench(self.T_gripper_sensor, readings - self.rest_reading)
        load = load - (self._weight(quaternion_wxyz) - self._weight(self.rest_quaternion_wxyz))
        R_tissue_gripper = rotation(quaternion_wxyz).as_matrix()
        return np.concatenate(
            [load[..., :3] @ R_tissue_gripper.T, load[..., 3:] @ R_tissue_gripper.T], axis=-1
        )

    def _weight(self, quaternion_wxyz: FloatArray) -> FloatArray:
        """Return the tool's weight (6,) in the axes and about the origin of the gripper."""
        force = self.tool.mass_kg * rotation(quaternion_wxyz).inv().apply(self.gravity)
        return np.concatenate([force, np.cross(self.tool.centre_m, force)])
