"""The physics between the emulated devices: the tissue follows the gripper, the sensor feels it, beads move."""

import threading
from collections.abc import Callable
from multiprocessing.connection import Connection

import numpy as np

from daq.frames import compose, inverse, rotation
from daq.rig import Frames, Tool
from daq.virtual_rig.phantom import PhantomMotion, PhantomState, increment
from estimator.errors import SolverError
from robot_drivers.protocols import FloatArray, Pose

_SOLVE_BEYOND_M = 5e-4
_SOLVE_BEYOND_RAD = 0.01
_FIRST_PULL_M = 1e-3
_IDLE_S = 0.005


class SimulatedTissue:
    """Follows the gripper: has the phantom solved, in another process, as soon as the gripper has moved on.

    Parameters
    ----------
    solver : takes a pose, answers with a :class:`PhantomState` or a SolverError
    tool_pose : returns ``T_base_tool`` as it truly is
    frames : of the rig
    """

    def __init__(self, solver: Connection, tool_pose: Callable[[], Pose], frames: Frames) -> None:
        self._solver = solver
        self._tool_pose = tool_pose
        self._T_tissue_base = inverse(frames.T_base_tissue.pose)
        self._T_tool_gripper = frames.T_tool_gripper.pose
        rest = self.gripper()
        x, y, z = rest.position
        pulled = Pose((x + _FIRST_PULL_M, y, z), rest.quaternion_wxyz)
        self._motion = PhantomMotion(self._solve(pulled), self._solve(rest))
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._follow, name="simulated-tissue")
        self._thread.start()

    def gripper(self) -> Pose:
        """Return ``T_tissue_gripper`` as it truly is."""
        return compose(compose(self._T_tissue_base, self._tool_pose()), self._T_tool_gripper)

    def wrench(self) -> tuple[FloatArray, Pose]:
        """Return the wrench (6,) of the tissue on the gripper, tissue axes, and the pose it belongs to."""
        pose = self.gripper()
        return self._motion.at(pose)[0], pose

    def beads(self) -> FloatArray:
        """Return the beads (m, 3) in the tissue frame, m."""
        return self._motion.at(self.gripper())[1]

    def close(self) -> None:
        """Stop following."""
        self._stopping.set()
        self._thread.join()

    def _follow(self) -> None:
        while not self._stopping.wait(_IDLE_S):
            pose = self.gripper()
            way = increment(self._motion.newest.T_tissue_gripper, pose)
            if np.linalg.norm(way[:3]) > _SOLVE_BEYOND_M or np.linalg.norm(way[3:]) > _SOLVE_BEYOND_RAD:
                self._motion = PhantomMotion(self._motion.newest, self._solve(pose))

    def _solve(self, pose: Pose) -> PhantomState:
        self._solver.send(pose)
        answer = self._solver.recv()
        if isinstance(answer, SolverError):
            raise answer
        return answer


class SimulatedTransducer:
    """What the force sensor is loaded with: the tissue, the weight of the tool, and a constant offset.

    Written out from the equilibrium of the tool, without the transformations that the evaluation of a recording uses.
    """

    def __init__(self, tissue: SimulatedTissue, frames: Frames, tool: Tool, offset: FloatArray) -> None:
        self._tissue = tissue
        self._tool = tool
        self._offset = offset
        T_gripper_sensor = frames.T_gripper_sensor.pose
        self._sensor_arm = np.asarray(T_gripper_sensor.position)
        self._R_gripper_sensor = rotation(T_gripper_sensor.quaternion_wxyz).as_matrix()

    def load(self, gravity: FloatArray) -> FloatArray:
        """Return the load (6,) on the sensor now, in its axes and about its origin; gravity in m/s², tissue frame."""
        wrench, pose = self._tissue.wrench()
        R_tissue_gripper = rotation(pose.quaternion_wxyz).as_matrix()
        sensor_arm = R_tissue_gripper @ self._sensor_arm
        mass_arm = R_tissue_gripper @ np.asarray(self._tool.centre_m)
        weight = self._tool.mass_kg * gravity
        force = wrench[:3] + weight
        torque = wrench[3:] + np.cross(mass_arm, weight) - np.cross(sensor_arm, force)
        R_tissue_sensor = R_tissue_gripper @ self._R_gripper_sensor
        return np.concatenate([force @ R_tissue_sensor, torque @ R_tissue_sensor]) + self._offset
