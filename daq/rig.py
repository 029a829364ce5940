"""The rig file: which devices there are, where they stand, what they may do, and what specimen is mounted.

Frames: ``base`` (robot), ``tool`` (robot flange or tool data), ``gripper`` (origin where the tissue is held),
``sensor`` (force sensor), ``tissue`` (fixed to the table, z up, origin at the centre of the phantom at rest).
``T_a_b`` is the pose of b in a. SI units.
"""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

from daq.devices import CAMERA, FORCE_SENSOR, ROBOT, AnyRole, Devices
from daq.errors import RigError
from daq.files.names import check_name
from daq.files.toml_tables import Keys, TomlFile, toml_text
from daq.limits import Limits
from daq.rig_cameras import check_cameras, no_depth
from daq.viewers import Viewers
from daq.vision.camera_model import StereoCalibration
from daq.vision.depth import DepthView
from daq.vision.fiducials import FiducialSettings
from daq.vision.planar import PlanarView
from estimator.experiment import Box, Environment, Grasp, Phantom, Roller
from robot_drivers.protocols import Pose
from robot_drivers.specification import CameraSpecification, ForceSensorSpecification, RobotSpecification

FORMAT = "retraction-rig/1"

Vector = tuple[float, float, float]

D = TypeVar("D", "Device", "CameraDevice")


@dataclass(frozen=True, slots=True)
class Transform:
    """A pose as it is written in a file."""

    position_m: Vector
    quaternion_wxyz: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        norm = sum(value * value for value in self.quaternion_wxyz) ** 0.5
        if abs(norm - 1.0) > 1e-6:
            raise ValueError(f"quaternion_wxyz has the length {norm:.8g}; a rotation needs 1 (scalar first)")

    @property
    def pose(self) -> Pose:
        """The same as a pose."""
        return Pose(self.position_m, self.quaternion_wxyz)


@dataclass(frozen=True, slots=True)
class Device:
    """A driver by its name in :mod:`daq.devices`, and that driver's settings."""

    driver: str
    settings: object = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class CameraDevice:
    """One camera by its name, its driver, and that driver's settings."""

    name: str
    driver: str
    settings: object = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_name(self.name, "name")


@dataclass(frozen=True, slots=True)
class Frames:
    """Where things are."""

    T_base_tissue: Transform
    T_tool_gripper: Transform
    T_gripper_sensor: Transform


@dataclass(frozen=True, slots=True)
class Tool:
    """What hangs on the force sensor: mass in kg, centre of mass in the gripper frame in m."""

    mass_kg: float
    centre_m: Vector


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Standard deviations, of certificates or calibration, that go in quadrature to the scatter within a window."""

    force_n: float = 0.0
    torque_nm: float = 0.0
    fiducial_m: float = 0.0
    position_m: float = 0.0


@dataclass(frozen=True, slots=True)
class Latencies:
    """How much later than the robot's the events of a stream are stamped, s; found by ``retract calibrate time``."""

    force_s: float = 0.0
    cameras_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Specimen:
    """The phantom as the operator believes it to be, tissue frame.

    Attributes
    ----------
    phantom_id : the same for all experiments on one mounting
    anchors, rollers : boxes in which the phantom does not move, and those in which not along some axes
    fiducials_m : design positions of the beads; their order is the order of the observations
    """

    phantom_id: str
    phantom: Phantom
    anchors: tuple[Box, ...]
    grasp: Grasp
    environment: Environment
    fiducials_m: tuple[Vector, ...]
    rollers: tuple[Roller, ...] = ()

    def __post_init__(self) -> None:
        check_name(self.phantom_id, "phantom_id")


@dataclass(frozen=True, slots=True)
class Rig:
    """Everything that a session needs to know before it begins.

    Of the one to four ``cameras`` the first two are left and right of a stereo pair, ``stereo_calibration`` is the file
    of its calibration, and ``vision`` says what their images show. Further cameras are recorded and nothing else. A rig
    with one camera has no stereo calibration: with a ``planar_view`` it measures beads in two dimensions, with a
    ``depth_view`` a depth camera measures them in three, without either nothing. ``calibration`` is the folder of the
    calibration files, None for none; what is in force there goes before what the rig file says
    (:mod:`daq.calibration_files.in_force`). ``laboratory_clock`` is the file of an emulated laboratory's clock
    (:mod:`daq.timing.laboratory_time`), and None for real devices. ``viewers`` may look on, None for nobody.
    """

    format: str
    name: str
    force_sensor: Device
    robot: Device
    cameras: tuple[CameraDevice, ...]
    frames: Frames
    tool: Tool
    limits: Limits
    specimen: Specimen
    uncertainty: Uncertainty = field(default_factory=Uncertainty)
    latencies: Latencies = field(default_factory=Latencies)
    vision: FiducialSettings = field(default_factory=FiducialSettings)
    stereo_calibration: Path | None = None
    planar_view: PlanarView | None = None
    depth_view: DepthView | None = None
    calibration: Path | None = None
    laboratory_clock: Path | None = None
    viewers: Viewers | None = None

    @property
    def only_view(self) -> PlanarView | DepthView | None:
        """How the only camera measures beads; None where it does not, or there are several."""
        return self.planar_view or self.depth_view

    def with_only_view_of(self, calibration: Path) -> "Rig":
        """Return the rig with another file of its only camera's calibration, where beads are measured with that."""
        planar, depth = self.planar_view, self.depth_view
        return replace(
            self,
            planar_view=None if planar is None else replace(planar, calibration=calibration),
            depth_view=None if depth is None else replace(depth, calibration=calibration),
        )

    @property
    def measuring_cameras(self) -> tuple[CameraDevice, ...]:
        """The cameras that beads are measured with: the stereo pair, the only one with a view, or none."""
        if len(self.cameras) > 1:
            return self.cameras[:2]
        return self.cameras if self.only_view is not None else ()

    @property
    def pair(self) -> tuple[CameraDevice, CameraDevice]:
        """The cameras of the stereo pair, left one first.

        Raises
        ------
        RigError
            There is one camera.
        """
        if len(self.cameras) < 2:
            raise RigError(f"rig {self.name!r} has one camera, which measures no place in space; two do")
        return (self.cameras[0], self.cameras[1])

    def stereo(self) -> StereoCalibration:
        """Read the calibration of the stereo pair.

        Raises
        ------
        RigError
            There is one camera, or the file is none.
        """
        left, right = self.pair
        if self.stereo_calibration is None:
            raise RigError(
                f"rig {self.name!r} names no stereo_calibration of its cameras {left.name!r} and {right.name!r}"
            )
        return StereoCalibration.load(self.stereo_calibration)

    def force_sensor_specification(self) -> ForceSensorSpecification:
        """Return what the driver says of the force sensor; raises RigError where there is no such driver."""
        return FORCE_SENSOR.specification(self.force_sensor.driver, self.force_sensor.settings)

    def robot_specification(self) -> RobotSpecification:
        """Return what the driver says of the robot; raises RigError where there is no such driver."""
        return ROBOT.specification(self.robot.driver, self.robot.settings)

    def camera_specifications(self) -> dict[str, CameraSpecification]:
        """Return what the drivers say of the cameras, by name; raises RigError where there is no such driver."""
        return {one.name: CAMERA.specification(one.driver, one.settings) for one in self.cameras}

    @property
    def with_depth(self) -> frozenset[str]:
        """The names of the cameras that send depth; raises RigError where there is no such driver."""
        return frozenset(name for name, told in self.camera_specifications().items() if told.depth)


def read_rig(path: Path, *, to_connect: bool = True) -> Rig:
    """Read a rig file.

    Parameters
    ----------
    to_connect : False for a rig that is only looked up, as that of a recording: its drivers need not be installed, and
        a device without one keeps its table of settings as it was written

    Raises
    ------
    RigError
        Naming file, line and key, and what is allowed there.
    """
    file = TomlFile.read(path)
    if file.root.get("format") != FORMAT:
        raise file.mistake(("format",), f'must be "{FORMAT}", not {file.root.get("format")!r}')
    rig = file.build(Rig, file.root)
    names = [camera.name for camera in rig.cameras]
    measured_by = {
        "stereo_calibration": rig.stereo_calibration,
        "planar_view": rig.planar_view,
        "depth_view": rig.depth_view,
    }
    check_cameras(file, names, [key for key, value in measured_by.items() if value is not None])
    with_settings = _with_settings if to_connect else _with_known_settings
    whole = replace(
        rig,
        force_sensor=with_settings(file, rig.force_sensor, FORCE_SENSOR, ("force_sensor",)),
        robot=with_settings(file, rig.robot, ROBOT, ("robot",)),
        cameras=tuple(
            with_settings(file, camera, CAMERA, ("cameras", number))
            for number, camera in enumerate(rig.cameras)
        ),
    )
    if to_connect and rig.depth_view is not None and not whole.with_depth:
        raise no_depth(file, names[0])
    return whole


def write_rig(rig: Rig, path: Path) -> None:
    """Write a rig file that :func:`read_rig` reads back."""
    path.write_text(toml_text(rig, path.parent), encoding="utf-8")


def make_devices(rig: Rig) -> Devices:
    """Make the devices of a rig, not connected yet."""
    return Devices(
        _made(rig.force_sensor, FORCE_SENSOR),
        _made(rig.robot, ROBOT),
        {camera.name: _made(camera, CAMERA) for camera in rig.cameras},
    )


def _made(device: Device | CameraDevice, role: AnyRole) -> Any:
    return role.named(device.driver).make(device.settings)


def _with_settings(file: TomlFile, device: D, role: AnyRole, keys: Keys) -> D:
    """Return the device with its settings table turned into the settings of its driver."""
    driver = role.driver(device.driver)
    if driver is None:
        raise file.mistake((*keys, "driver"), f"must be {role.to_choose_from()}, not {device.driver!r}")
    return replace(device, settings=file.build(driver.settings, device.settings, (*keys, "settings")))


def _with_known_settings(file: TomlFile, device: D, role: AnyRole, keys: Keys) -> D:
    """Return the same where the driver is one of this project's, else the device as it is."""
    return _with_settings(file, device, role, keys) if device.driver in role.own else device
