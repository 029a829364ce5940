"""What a driver says beforehand of the device that its settings describe: ranges, noise, axes, frames.

Each is known without a connection, so that a plan can be judged before the device is switched on. What is None is not
known, and is neither checked nor assumed.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

from robot_drivers.errors import ConfigurationError
from robot_drivers.protocols import JOINT_COUNTS, Pose

Six = tuple[float, float, float, float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class ForceSensorSpecification:
    """What is known of a force sensor.

    Attributes
    ----------
    host : where it is reached on a network; empty where by none
    rated_wrench : (6,) range, ± N for Fx Fy Fz and ± N·m for Tx Ty Tz
    noise_std : (6,) standard deviation of one sample at rest, N and N·m, without the rounding to counts
    resolution : (6,) size of a count, N and N·m; None where it is far below the noise
    rate_hz : samples a second that the settings ask for
    """

    host: str = ""
    rated_wrench: Six | None = None
    noise_std: Six | None = None
    resolution: Six | None = None
    rate_hz: float | None = None

    def __post_init__(self) -> None:
        for name in ("rated_wrench", "noise_std", "resolution"):
            _check_six(name, getattr(self, name))


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotSpecification:
    """What is known of a robot.

    Attributes
    ----------
    host : where it is reached on a network; empty where by none
    joints : how many, 6 or 7
    joint_limits : (lower, upper) of each joint, rad
    T_flange_tool : the tool data of its controller: where the tool frame that the driver reports is on the flange
    """

    host: str = ""
    joints: int = 6
    joint_limits: tuple[tuple[float, float], ...] | None = None
    T_flange_tool: Pose = field(default_factory=lambda: Pose((0.0, 0.0, 0.0)))

    def __post_init__(self) -> None:
        if self.joints not in JOINT_COUNTS:
            raise ConfigurationError(
                f"joints {self.joints}: a robot has {' or '.join(map(str, JOINT_COUNTS))}"
            )
        if self.joint_limits is not None and len(self.joint_limits) != self.joints:
            raise ConfigurationError(
                f"joint_limits: of {len(self.joint_limits)} joints, the robot has {self.joints}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraSpecification:
    """What is known of a camera.

    Attributes
    ----------
    host : where it is reached on a network; empty where by none
    frames_per_s : that the settings ask for
    depth : whether each image comes with one of depth
    """

    host: str = ""
    frames_per_s: float | None = None
    depth: bool = False


def _check_six(name: str, values: Sequence[float] | None) -> None:
    if values is not None and (len(values) != 6 or not all(value >= 0 for value in values)):
        raise ConfigurationError(f"{name} {values}: must be six numbers that are not negative")
