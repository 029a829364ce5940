"""What each kind of calibration finds, as plain tables of numbers that a TOML file holds."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from daq.calibration_files.outcome import Kind
from daq.rig import Transform, Vector
from daq.vision.camera_model import PinholeCamera, StereoCalibration

LATE_STREAMS = ("force sensor", "cameras")
"""The streams whose latency against the robot's can be found."""

Six = tuple[float, float, float, float, float, float]


@dataclass(frozen=True, slots=True)
class Lens:
    """The intrinsics of one camera, px, and their standard deviations (fx fy cx cy, px; k1 k2 p1 p2)."""

    width: int
    height: int
    focal_length: tuple[float, float]
    principal_point: tuple[float, float]
    distortion: tuple[float, float, float, float, float]
    rms_px: float
    std: tuple[float, float, float, float, float, float, float, float]


@dataclass(frozen=True, slots=True)
class CamerasResult:
    """Both lenses, each calibrated alone."""

    left: Lens
    right: Lens


@dataclass(frozen=True, slots=True)
class RobotResult:
    """Where the tissue frame, and with it the cameras, are in the robot's base frame.

    Attributes
    ----------
    T_base_tissue, T_base_left_camera : poses
    marker_in_tool_m : where the marker sits on the gripper; zero for touched landmarks
    position_std_m : of the tissue frame's origin, a coordinate
    rms_m : of what registration leaves, a coordinate
    """

    T_base_tissue: Transform
    T_base_left_camera: Transform
    marker_in_tool_m: Vector
    position_std_m: float
    rms_m: float


@dataclass(frozen=True, slots=True)
class ForceResult:
    """What hangs on the sensor and what it reads without load.

    Attributes
    ----------
    mass_kg, mass_std_kg : beyond the sensor
    centre_m, centre_std_m : centre of mass in the gripper frame
    offset, offset_std : reading without load, N and N·m, sensor frame
    noise_std : of one sample, N and N·m
    """

    mass_kg: float
    mass_std_kg: float
    centre_m: Vector
    centre_std_m: Vector
    offset: Six
    offset_std: Six
    noise_std: Six


@dataclass(frozen=True, slots=True)
class StreamLatency:
    """How much later than the robot's a stream's events are stamped, and the correlation that tells so.

    Attributes
    ----------
    stream : "force sensor" or "cameras"
    latency_s, std_s : stamp of the stream minus stamp of the robot, of one event
    lags_s, correlation, correlation_std : the curve over the lag, and its standard deviation
    """

    stream: str
    latency_s: float
    std_s: float
    lags_s: tuple[float, ...]
    correlation: tuple[float, ...]
    correlation_std: tuple[float, ...]

    def __post_init__(self) -> None:
        if self.stream not in LATE_STREAMS:
            raise ValueError(
                f"stream must be one of {', '.join(map(repr, LATE_STREAMS))}, not {self.stream[:40]!r}"
            )


@dataclass(frozen=True, slots=True)
class TimeResult:
    """The latencies of the streams against the robot's, by one procedure."""

    procedure: str
    streams: tuple[StreamLatency, ...]


@dataclass(frozen=True, slots=True)
class ToolResult:
    """The gripper's centre point in the frames of the tool data and the flange, and its deviation a coordinate, m."""

    gripper_in_tool_m: Vector
    gripper_in_flange_m: Vector
    std_m: float


RESULTS: Mapping[Kind, type[Any]] = {
    "camera": PinholeCamera,
    "cameras": CamerasResult,
    "stereo": StereoCalibration,
    "robot": RobotResult,
    "force": ForceResult,
    "time": TimeResult,
    "tool": ToolResult,
}
