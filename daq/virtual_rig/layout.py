"""Where everything stands in the virtual laboratory.

The phantom lies on a table in front of the robot, the tool points down, its tool data end where the tissue is held,
and the gripper's axes are those of the tissue at rest. The force sensor sits between flange and gripper, turned about
the tool's axis, so that its axes are nobody else's.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from daq.frames import compose, inverse
from daq.limits import Limits
from daq.rig import FORMAT, CameraDevice, Device, Frames, Rig, Specimen, Tool, Transform, Uncertainty, Vector
from daq.vision.depth import DepthView
from daq.vision.planar import PlanarView
from estimator.experiment import Box, Environment, Grasp, Phantom
from robot_drivers.abb.egm.position_stream import EGMSettings
from robot_drivers.abb.irb140 import IRB140Settings
from robot_drivers.ati.netft import NetFTSettings
from robot_drivers.cameras.opencv_capture import OpenCVCameraSettings
from robot_drivers.genicam import GenICamSettings
from robot_drivers.protocols import Pose

GRASP_CENTRE = (0.04, 0.0, 0.0)
T_FLANGE_TOOL = Pose((0.0, 0.0, 0.14))
_HALF_TURN_ABOUT_X = (0.0, 1.0, 0.0, 0.0)
_SENSOR_TURN = math.radians(30.0)

FRAMES = Frames(
    T_base_tissue=Transform((0.45, 0.0, 0.2)),
    T_tool_gripper=Transform((0.0, 0.0, 0.0), _HALF_TURN_ABOUT_X),
    # half a turn about x, then 30° about the sensor's own z
    T_gripper_sensor=Transform(
        (0.0, 0.0, 0.10), (0.0, math.cos(_SENSOR_TURN / 2), -math.sin(_SENSOR_TURN / 2), 0.0)
    ),
)
REST_TOOL = compose(
    compose(FRAMES.T_base_tissue.pose, Pose(GRASP_CENTRE)), inverse(FRAMES.T_tool_gripper.pose)
)
TOOL = Tool(mass_kg=0.35, centre_m=(0.0, 0.0, 0.06))

SPECIMEN = Specimen(
    phantom_id="virtual",
    phantom=Phantom("block", (0.1, 0.1, 0.01)),
    anchors=(Box((-0.0501, -0.0501, -0.0051), (-0.0499, 0.0501, 0.0051)),),
    grasp=Grasp(Box((0.03, -0.01, -0.0051), (0.05, 0.01, 0.0051)), GRASP_CENTRE),
    environment=Environment(),
    fiducials_m=tuple((x, y, 0.005) for y in (-0.03, -0.01, 0.01, 0.03) for x in (-0.03, -0.01, 0.01, 0.03)),
)

# The robot's repeatability, and how far the beads that vision finds lie from the rendered ones, rms a coordinate.
UNCERTAINTY = Uncertainty(position_m=3e-5, fiducial_m=7e-6)

PAIR, ONLY = ("left", "right"), ("above",)
"""Names of the cameras: of the stereo pair, or of the only one."""

DEPTH_STD_M, DEPTH_RANGE_M = 3e-5, 0.4
"""By how much the depth of the emulated depth camera is off in all images alike, and where."""

_DEPTH_PACKET_BYTES = 9000

HEIGHT_STD_M = 2e-4
"""How far the beads may leave the height at which they rest, for a rig with one camera."""

FORCE_FILTER_S = 0.01
"""By how much the emulated sensor's low-pass filter delays the force: more than two cycles of the controller."""

CAMERA_READOUT_S = 0.05
"""From an exposure until its image leaves the emulated camera: enough for a busy machine to render it."""

# An emulated laboratory shares the computer with the recorder; on a busy one nothing answers at once.
PATIENCE_S = 5.0

STREAM_PATIENCE_S = 300.0
"""Of the two ends of an image stream: FFmpeg counts by the computer's clock, also while the laboratory's waits."""

LIMITS = Limits(
    force_n=15.0,
    torque_nm=1.5,
    step_m=0.0065,
    speed_m_s=0.02,
    workspace=Box((0.03, -0.02, -0.01), (0.07, 0.02, 0.01)),
    communication_age_s=PATIENCE_S,
)


@dataclass(frozen=True, slots=True)
class Addresses:
    """Where the emulators listen, all on this host; a depth camera takes the place of all that have an URL."""

    rdt_port: int
    http_port: int
    ft_command_port: int
    robot_command_port: int
    robot_state_port: int
    egm_port: int
    camera_urls: tuple[str, ...]
    depth_camera: str = ""


def placed_beads(seed: int) -> tuple[Vector, ...]:
    """Return where the beads really are: half a millimetre off the design, none in the gripper, m."""
    design = np.array(SPECIMEN.fiducials_m)
    placed = design + np.random.default_rng(seed).normal(0.0, 5e-4, design.shape) * (1.0, 1.0, 0.0)
    placed[:, 0] = np.minimum(placed[:, 0], 0.0285)
    return tuple((x, y, z) for x, y, z in placed.tolist())


def rig_description(addresses: Addresses, calibration: Path) -> Rig:
    """Return the rig file's content for emulators at these addresses.

    Parameters
    ----------
    calibration : file of the calibration of the stereo pair, or of the only camera, by the number of addresses
    """
    with_depth = bool(addresses.depth_camera)
    names = PAIR if len(addresses.camera_urls) > 1 else ONLY
    cameras = tuple(_camera(name, url) for name, url in zip(names, addresses.camera_urls, strict=False))
    return Rig(
        format=FORMAT,
        name="virtual rig",
        stereo_calibration=calibration if names is PAIR else None,
        planar_view=PlanarView(calibration, HEIGHT_STD_M) if names is ONLY and not with_depth else None,
        depth_view=DepthView(calibration, DEPTH_STD_M, DEPTH_RANGE_M) if with_depth else None,
        force_sensor=Device(
            "netft",
            NetFTSettings(
                host="127.0.0.1",
                rdt_port=addresses.rdt_port,
                http_port=addresses.http_port,
                command_port=addresses.ft_command_port,
            ),
        ),
        robot=Device(
            "irb140",
            IRB140Settings(
                host="127.0.0.1",
                command_port=addresses.robot_command_port,
                state_port=addresses.robot_state_port,
                silence_limit_s=PATIENCE_S,
                egm=EGMSettings(port=addresses.egm_port, bind_address="127.0.0.1"),
                T_flange_tool=T_FLANGE_TOOL,
            ),
        ),
        cameras=(_depth_camera(addresses.depth_camera),) if with_depth else cameras,
        frames=FRAMES,
        tool=TOOL,
        limits=LIMITS,
        specimen=SPECIMEN,
        uncertainty=UNCERTAINTY,
    )


def _depth_camera(host: str) -> CameraDevice:
    settings = GenICamSettings(
        camera=host,
        depth=True,
        packet_size=_DEPTH_PACKET_BYTES,
        open_timeout_s=STREAM_PATIENCE_S,
        silence_s=STREAM_PATIENCE_S,
    )
    return CameraDevice(ONLY[0], "genicam", settings)


def _camera(name: str, url: str) -> CameraDevice:
    settings = OpenCVCameraSettings(
        url,
        backend="ffmpeg",
        embedded_info=("timestamp", "frame_counter"),
        open_timeout_s=STREAM_PATIENCE_S,
        read_timeout_s=STREAM_PATIENCE_S,
    )
    return CameraDevice(name, "opencv", settings)
