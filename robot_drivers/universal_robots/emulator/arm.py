"""The emulated arm with the servo program on it, advanced cycle by cycle."""

import math
from collections.abc import Mapping

from robot_drivers.clock import host_time_s
from robot_drivers.errors import MotionRefusedError
from robot_drivers.motion import poses
from robot_drivers.protocols import Pose
from robot_drivers.universal_robots.arms import LENGTHS, Joints
from robot_drivers.universal_robots.emulator.settings import CYCLE_S, UREmulatorSettings, URFaults
from robot_drivers.universal_robots.robot.kinematics import continued, flange_pose
from robot_drivers.universal_robots.robot.registers import (
    LARGEST_JUMP_M,
    PROGRAM_VERSION,
    Doing,
    Order,
    pose_of,
    vector_of,
)
from robot_drivers.universal_robots.rtde.packages import Value

_LARGEST_TURN_RAD = 0.05


class EmulatedArm:
    """Where it is, and what the servo program makes of the registers.

    Attributes
    ----------
    T_base_tool : where the tool is
    doing : what the program does
    """

    def __init__(self, settings: UREmulatorSettings) -> None:
        self._settings, self._lengths = settings, LENGTHS[settings.arm]
        self._joints: Joints = settings.home
        self.T_base_tool = poses.compose(flange_pose(self._lengths, settings.home), settings.T_flange_tool)
        self._speed: Joints = (0.0,) * 6
        self.doing = Doing.STANDING
        self._heard_s, self._beat = -math.inf, 0
        self._told_at = self.T_base_tool
        self._last = self.T_base_tool

    def step(self, registers: Mapping[str, Value], faults: URFaults) -> None:
        """Go through one cycle of the controller."""
        before = self.T_base_tool
        runs = not (faults.program_stopped or faults.protective_stop or faults.powered_off)
        if runs:
            self._program(registers)
        else:
            self.doing, self._heard_s = Doing.STANDING, -math.inf
        if runs and self.doing is Doing.FOLLOWING and not faults.stuck:
            share = 1.0 - math.exp(-CYCLE_S / self._settings.servo_time_s)
            x, y, z = self._last.position
            wanted = Pose((x, y, z + faults.slip), self._last.quaternion_wxyz)
            self.T_base_tool = poses.interpolate(self.T_base_tool, wanted, share)
        way = poses.compose(poses.inverse(before), self.T_base_tool)
        vx, vy, vz, wx, wy, wz = (part / CYCLE_S for part in vector_of(way))
        self._speed = (vx, vy, vz, wx, wy, wz)

    def outputs(self, faults: URFaults) -> dict[str, Value]:
        """Return what the controller tells of it."""
        settings = self._settings
        self._joints = self._joints_now()
        running = not (faults.program_stopped or faults.protective_stop or faults.powered_off)
        tcp = vector_of(settings.T_flange_tool)
        told: dict[str, Value] = {
            "actual_q": self._joints,
            "actual_TCP_pose": vector_of(self.T_base_tool),
            "actual_TCP_speed": self._speed,
            "robot_mode": 3 if faults.powered_off else 7,
            "safety_mode": 3 if faults.protective_stop else 1,
            "runtime_state": 2 if running else 1,
            "output_int_register_24": PROGRAM_VERSION,
            "output_int_register_25": int(self.doing),
            "output_int_register_26": self._beat,
        }
        return told | {f"output_double_register_{24 + axis}": value for axis, value in enumerate(tcp)}

    def _joints_now(self) -> Joints:
        if self.T_base_tool == self._told_at:
            return self._joints
        self._told_at = self.T_base_tool
        T_base_flange = poses.compose(self.T_base_tool, poses.inverse(self._settings.T_flange_tool))
        try:
            return continued(self._lengths, T_base_flange, self._joints)
        except MotionRefusedError:
            return self._joints

    def _program(self, registers: Mapping[str, Value]) -> None:
        """As ``script/retract_servo.script``, line by line."""
        numbers = {name: value for name, value in registers.items() if not isinstance(value, tuple)}
        beat, order = int(numbers["input_int_register_25"]), int(numbers["input_int_register_24"])
        if beat != self._beat:
            self._heard_s, self._beat = host_time_s(), beat
        target = pose_of(tuple(float(numbers[f"input_double_register_{24 + axis}"]) for axis in range(6)))
        if order == Order.STAND:
            self.doing = Doing.STANDING
        elif self.doing in (Doing.STANDING, Doing.FOLLOWING):
            last = self.T_base_tool if self.doing is Doing.STANDING else self._last
            jump, turn = poses.distance(last, target)
            if host_time_s() - self._heard_s > self._settings.silence_s:
                self.doing = Doing.SILENCE
            elif jump > LARGEST_JUMP_M or turn > _LARGEST_TURN_RAD:
                self.doing = Doing.JUMP
            else:
                self.doing, self._last = Doing.FOLLOWING, target
