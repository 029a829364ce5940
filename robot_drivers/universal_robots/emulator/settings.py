"""What an emulated controller is like, and what goes wrong with it."""

import math
from dataclasses import dataclass

from robot_drivers.emulated_outages import Outages
from robot_drivers.motion import poses
from robot_drivers.protocols import Pose
from robot_drivers.specification import Six
from robot_drivers.universal_robots.arms import Arm, Joints
from robot_drivers.universal_robots.robot.registers import MOST_SILENT_CYCLES

CYCLE_S = 0.002
"""Of the controller."""


@dataclass(frozen=True, slots=True, kw_only=True)
class URFaults(Outages):
    """What goes wrong; the default is nothing. Times count from the injection.

    Attributes
    ----------
    loss : probability of each sample to be left out, as a busy controller does
    rubbish : probability of each sample to be followed by one that no recipe knows
    cut : probability of each sample to be followed by one of another length
    mute : the RTDE server hangs: connections stand, nothing is told
    protective_stop : a safety function has stopped the arm
    powered_off : the arm is off
    program_stopped : the servo program does not run
    stuck : the arm follows no reference
    slip : how far beside its reference the arm stands while it follows, m, along z of the base
    """

    loss: float = 0.0
    rubbish: float = 0.0
    cut: float = 0.0
    mute: bool = False
    protective_stop: bool = False
    powered_off: bool = False
    program_stopped: bool = False
    stuck: bool = False
    slip: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class UREmulatorSettings:
    """A controller.

    Attributes
    ----------
    bind_address, port : where its RTDE server listens; port 0 takes any free one
    arm : which arm it is
    home : joint angles at the start, rad
    T_flange_tool : the tool centre point of the installation
    silence_s : without a new beat for so long, the servo program brakes; 0.1 of the real one
    servo_time_s : by which the arm trails its reference
    noise_std : of the sensor in the flange, N and N·m, white; of a real one it is not known
    clock_ppm : how much faster its clock runs than that of this computer
    software : version of its software
    seed : of all random numbers of the emulator
    """

    bind_address: str = "127.0.0.1"
    port: int = 0
    arm: Arm = "UR5e"
    home: Joints = (0.0, -math.radians(90), math.radians(100), -math.radians(100), -math.radians(90), 0.0)
    T_flange_tool: Pose = poses.IDENTITY
    silence_s: float = CYCLE_S * MOST_SILENT_CYCLES
    servo_time_s: float = 0.03
    noise_std: Six = (0.01, 0.01, 0.01, 5e-4, 5e-4, 5e-4)
    clock_ppm: float = 0.0
    software: tuple[int, int, int, int] = (5, 14, 6, 1)
    seed: int = 0
