"""The physics between the emulated devices: the tissue follows the gripper, the sensor feels it, beads move."""

import math
import multiprocessing
import threading
import time
from bisect import bisect_left
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection

import numpy as np

from daq.rig import Frames, Tool, Vector
from daq.virtual_rig.physics.phantom import PhantomMotion, PhantomState, increment
from estimator.errors import SolverError
from robot_drivers.clock import host_time_ns
from robot_drivers.motion import poses
from robot_drivers.protocols import FloatArray, Pose

_SOLVE_BEYOND_M = 5e-4
_SOLVE_BEYOND_RAD = 0.01
# Behind by this much, the tissue's state is extrapolated beyond what it is good for.
_BEHIND_M = 3e-3
_FIRST_PULL_M = 1e-3
_SPEED_OVER_NS = 10_000_000
_SAMPLE_S = 0.004
_LATEST_CYCLE_NS = 100_000_000
_POLL_S = 0.0005


class SimulatedTissue:
    """Follows the gripper: has the phantom solved, in another process, as soon as the gripper has moved on.

    The devices ask for an instant, not for now: a device that is late still senses what was, and one that asks before
    the controller has gone through the cycle after that instant waits for it. To take the newest pose instead would
    let every device sense the motion two milliseconds late.

    Parameters
    ----------
    solver : takes a pose, answers with a :class:`PhantomState` or a SolverError
    path : returns host times, ns, and ``T_base_tool`` as it truly was then, oldest first
    frames : of the rig
    tell : called, from another thread, with a line about what goes wrong

    Where the laboratory's clock does not wait for the tissue (:meth:`behind_s`, :meth:`room_s`) and the computer has
    too much else to do the tissue falls behind, which is told, once each time that it does: beads and forces are then
    not those of the phantom.

    Attributes
    ----------
    ended : comes to its end when the phantom cannot be solved any more
    """

    def __init__(
        self,
        solver: Connection,
        path: Callable[[], Sequence[tuple[int, Pose]]],
        frames: Frames,
        tell: Callable[[str], None],
    ) -> None:
        self._tell = tell
        self._solver = solver
        self._path = path
        self._T_tissue_base = poses.inverse(frames.T_base_tissue.pose)
        self._T_tool_gripper = frames.T_tool_gripper.pose
        rest = self._gripper_at(path()[-1][1])
        x, y, z = rest.position
        pulled = Pose((x + _FIRST_PULL_M, y, z), rest.quaternion_wxyz)
        self._motion = PhantomMotion(self._solve(pulled), self._solve(rest))
        self._asked_ns: int | None = None
        self.ended, self._end = multiprocessing.Pipe(duplex=False)
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="phantom-follower")
        self._thread.start()

    def wrench(self, time_ns: int) -> tuple[FloatArray, Pose]:
        """Return the wrench (6,) of the tissue on the gripper, tissue axes, and the pose it belongs to."""
        pose = self._gripper(time_ns)
        return self._motion.wrench(pose), pose

    def beads(self, time_ns: int) -> FloatArray:
        """Return the beads (m, 3) in the tissue frame, m."""
        return self._motion.beads(self._gripper(time_ns))

    def behind_s(self) -> float:
        """Return since when, s, a solution is awaited."""
        asked_ns = self._asked_ns
        return 0.0 if asked_ns is None else (host_time_ns() - asked_ns) * 1e-9

    def room_s(self) -> float:
        """Return for how long, s, the gripper may go on as it does before it is too far beyond the last solution.

        Also where no solution was asked for yet. A gripper that is where it was solved for may always go on, through
        a cycle of the controller at least.
        """
        path = self._path()
        time_ns, gripper = path[-1][0], self._gripper_at(path[-1][1])
        recent = path[bisect_left(path, time_ns - _SPEED_OVER_NS, key=lambda sample: sample[0])]
        way_m = _distance(self._motion.newest.T_tissue_gripper, gripper)
        moved_m = _distance(self._gripper_at(recent[1]), gripper)
        left_m = _BEHIND_M - _SOLVE_BEYOND_M - way_m
        if moved_m == 0.0:
            return math.inf if left_m > 0.0 else 0.0
        room_s = left_m / moved_m * (time_ns - recent[0]) * 1e-9 - (host_time_ns() - time_ns) * 1e-9
        return max(room_s, _SAMPLE_S) if way_m <= _SOLVE_BEYOND_M else room_s

    def close(self) -> None:
        """Stop following."""
        self._stopping.set()
        self._thread.join()
        self.ended.close()

    def _gripper_at(self, T_base_tool: Pose) -> Pose:
        return poses.compose(poses.compose(self._T_tissue_base, T_base_tool), self._T_tool_gripper)

    def _gripper(self, time_ns: int) -> Pose:
        """Return ``T_tissue_gripper`` at an instant of the host clock, between the samples of its path."""
        path = self._path_beyond(time_ns)
        place = bisect_left(path, time_ns, key=lambda sample: sample[0])
        if place == 0:
            return self._gripper_at(path[0][1])
        if place == len(path):
            return self._gripper_at(path[-1][1])
        (before_ns, before), (after_ns, after) = path[place - 1], path[place]
        if before == after:
            return self._gripper_at(before)
        between = poses.interpolate(before, after, (time_ns - before_ns) / (after_ns - before_ns))
        return self._gripper_at(between)

    def _path_beyond(self, time_ns: int) -> Sequence[tuple[int, Pose]]:
        """Wait until the path reaches beyond an instant; a controller without power stands where it was."""
        path = self._path()
        while path[-1][0] < time_ns and host_time_ns() < time_ns + _LATEST_CYCLE_NS:
            time.sleep(_POLL_S)
            path = self._path()
        return path

    def _run(self) -> None:
        try:
            self._follow()
        except (SolverError, EOFError, OSError) as error:
            self._tell(f"the virtual phantom cannot be solved any more ({error!r}); its laboratory ends")
        finally:
            self._end.close()

    def _follow(self) -> None:
        told = False
        while not self._stopping.wait(_SAMPLE_S):
            pose = self._gripper_at(self._path()[-1][1])
            way = increment(self._motion.newest.T_tissue_gripper, pose)
            behind_m = float(np.linalg.norm(way[:3]))
            if behind_m > _BEHIND_M and not told:
                self._tell(_fallen_behind(behind_m))
            told = behind_m > _BEHIND_M
            if np.linalg.norm(way[:3]) > _SOLVE_BEYOND_M or np.linalg.norm(way[3:]) > _SOLVE_BEYOND_RAD:
                self._asked_ns = host_time_ns()
                self._motion = PhantomMotion(self._motion.newest, self._solve(pose))
                self._asked_ns = None

    def _solve(self, pose: Pose) -> PhantomState:
        self._solver.send(pose)
        answer = self._solver.recv()
        if isinstance(answer, SolverError):
            raise answer
        return answer


def _distance(T_tissue_gripper: Pose, other: Pose) -> float:
    return float(np.linalg.norm(increment(T_tissue_gripper, other)[:3]))


def _fallen_behind(behind_m: float) -> str:
    return (
        f"the virtual phantom is {1e3 * behind_m:.1f} mm behind the gripper, for this computer has too much else "
        "to do: what is recorded now is not what the phantom does; close other programs and record anew"
    )


class SimulatedTransducer:
    """What the force sensor is loaded with: the tissue, the weight of the tool, and a constant offset.

    Written out from the equilibrium of the tool, without the transformations that the evaluation of a recording uses.
    """

    def __init__(
        self, tissue: SimulatedTissue, frames: Frames, tool: Tool, gravity: Vector, offset: FloatArray
    ) -> None:
        self._tissue = tissue
        self._offset = offset
        self._weight = tool.mass_kg * np.asarray(gravity)
        T_gripper_sensor = frames.T_gripper_sensor.pose
        # rows: the arm times each unit vector, so that the arm times a force is the force times the matrix
        self._by_mass_arm = np.cross(tool.centre_m, np.eye(3))
        self._by_sensor_arm = np.cross(T_gripper_sensor.position, np.eye(3))
        self._R_gripper_sensor = np.array(poses.matrix(T_gripper_sensor.quaternion_wxyz))

    def load(self, time_ns: int) -> FloatArray:
        """Return the load (6,) on the sensor at an instant of the host clock, in its axes and about its origin."""
        wrench, pose = self._tissue.wrench(time_ns)
        R_tissue_gripper = np.array(poses.matrix(pose.quaternion_wxyz))
        # in the gripper's axes
        weight = self._weight @ R_tissue_gripper
        force = wrench[:3] @ R_tissue_gripper + weight
        torque = wrench[3:] @ R_tissue_gripper + weight @ self._by_mass_arm - force @ self._by_sensor_arm
        return (
            np.concatenate([force @ self._R_gripper_sensor, torque @ self._R_gripper_sensor]) + self._offset
        )
