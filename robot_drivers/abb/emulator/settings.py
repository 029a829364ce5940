"""What an emulated controller is like, and what goes wrong with it."""

from dataclasses import dataclass, field

from robot_drivers.emulated_outages import Outages
from robot_drivers.motion import poses
from robot_drivers.motion.poses import Vector
from robot_drivers.protocols import Pose

TOOL_DOWN = (0.0, 0.0, 1.0, 0.0)
"""Orientation of a tool whose z axis points at the table."""


@dataclass(frozen=True, slots=True)
class ArmSettings:
    """The emulated arm; SI units.

    Attributes
    ----------
    home : ``T_base_tool`` at the start; the default is over the table with axis 5 at 43°
    home_joints_near : angles near those at home, rad; they choose the configuration
    T_flange_tool : the controller's tool data
    linear_acceleration, angular_acceleration : of ordinary motions, m/s² and rad/s²
    stop_factor : how many times harder a stop brakes
    repeatability_std : how far from the encoders' pose the tool comes to stand, m, drawn anew with each
        motion
    encoder_noise_std : noise of every joint reading, rad
    seed : of all random numbers of the emulator
    """

    home: Pose = field(default_factory=lambda: Pose((0.45, 0.0, 0.35), TOOL_DOWN))
    home_joints_near: tuple[float, float, float, float, float, float] = (0.0, 0.3, 0.5, 0.0, 0.8, 0.0)
    T_flange_tool: Pose = poses.IDENTITY
    linear_acceleration: float = 0.5
    angular_acceleration: float = 2.0
    stop_factor: float = 4.0
    repeatability_std: float = 1e-5
    encoder_noise_std: float = 2e-6
    seed: int = 0


@dataclass(frozen=True, slots=True)
class InstalledLimits:
    """The limits in the RAPID modules, in their units (mm, °, mm/s, °/s); a client can only narrow them."""

    lower: Vector = (200.0, -400.0, 0.0)
    upper: Vector = (750.0, 400.0, 900.0)
    step: float = 100.0
    turn: float = 45.0
    speed: float = 250.0
    turning_speed: float = 90.0


@dataclass(frozen=True, slots=True)
class ControllerFaults(Outages):
    """What goes wrong; the default is nothing. Times count from the injection.

    Attributes
    ----------
    egm_loss, egm_duplicate, egm_reorder, egm_truncation, egm_rubbish : probability of each datagram to be left out,
        to be sent twice, to change places with the next one, to be cut short, to be followed by one of random bytes
    egm_delay_s : extra time that every datagram spends on its way
    stop_at_fraction : at this part of the way of any motion the controller stops its motion program, as it
        does for a collision
    drop_at_fraction : at this part of the way both TCP connections break
    mute : the RAPID tasks hang: connections stand, nothing is answered or streamed
    landing_offset : how far beside its target a motion ends, m
    unplug_at_s, unplug_for_s : the network cable is out meanwhile: nothing comes or goes, connections stand
    restart_at_s, restart_for_s : the controller is off meanwhile; its connections break, and its clock, numbers and
        session limits begin anew. An operator has switched motors and program on when it is back
    """

    egm_loss: float = 0.0
    egm_duplicate: float = 0.0
    egm_reorder: float = 0.0
    egm_truncation: float = 0.0
    egm_rubbish: float = 0.0
    egm_delay_s: float = 0.0
    stop_at_fraction: float | None = None
    drop_at_fraction: float | None = None
    mute: bool = False
    landing_offset: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class EmulatorSettings:
    """A controller.

    Attributes
    ----------
    bind_address, command_port, state_port : where the RAPID server listens; port 0 takes any free one
    start_delay_s : time from power-up until the RAPID tasks answer
    watchdog_s : silence of the client after which a motion is stopped
    settle_s : time the tool stands before the end of a motion is reported
    state_period_cycles : state frames come every so many cycles of 4.032 ms
    serial, robotware : what IDENTIFY tells
    """

    arm: ArmSettings = field(default_factory=ArmSettings)
    limits: InstalledLimits = field(default_factory=InstalledLimits)
    faults: ControllerFaults = field(default_factory=ControllerFaults)
    bind_address: str = "127.0.0.1"
    command_port: int = 0
    state_port: int = 0
    start_delay_s: float = 0.0
    watchdog_s: float = 0.5
    settle_s: float = 0.05
    state_period_cycles: int = 3
    serial: str = "140-500000"
    robotware: str = "6.08"
