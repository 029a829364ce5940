"""The rig file: which devices there are, where they stand, what they may do, and what specimen is mounted.

Frames: ``base`` (robot), ``tool`` (robot flange or tool data), ``gripper`` (origin where the tissue is held),
``sensor`` (force sensor), ``tissue`` (fixed to the table, z up, origin at the centre of the phantom at rest).
``T_a_b`` is the pose of b in a. SI units.
"""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

from daq.devices import CAMERA, FORCE_SENSOR, ROBOT, Devices, Role, installed_drivers
from daq.errors import RigError
from daq.files.names import check_name
from daq.files.toml_tables import Keys, TomlFile, toml_text
from daq.vision.fiducials import FiducialSettings
from estimator.experiment import Box, Environment, Grasp, Phantom
from robot_drivers.protocols import Pose

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
    """One camera of the stereo pair."""

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
class Limits:
    """What stops the robot, and what no trajectory may ask for.

    Attributes
    ----------
    force_n, torque_nm : magnitude of the interaction, as it changed since the rest window
    step_m : largest way of the gripper's origin between two standstills
    speed_m_s : of the gripper's origin
    workspace : box for the gripper's origin, tissue frame, m
    communication_age_s : longest silence of the force sensor or the robot
    force_rate_n_s, torque_rate_nm_s : of the interaction, over 20 ms
    """

    force_n: float
    torque_nm: float
    step_m: float
    speed_m_s: float
    workspace: Box
    communication_age_s: float = 0.25
    force_rate_n_s: float = 200.0
    torque_rate_nm_s: float = 20.0

    def __post_init__(self) -> None:
        rates = ("force_rate_n_s", "torque_rate_nm_s")
        for name in ("force_n", "torque_nm", "step_m", "speed_m_s", "communication_age_s", *rates):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} must be positive, not {getattr(self, name)!r}")


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Standard deviations that the scatter within a window does not show, from certificates or calibration.

    They are added in quadrature to the scatter that a recording shows.
    """

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
    anchors : boxes in which the phantom does not move
    fiducials_m : design positions of the beads; their order is the order of the observations
    """

    phantom_id: str
    phantom: Phantom
    anchors: tuple[Box, ...]
    grasp: Grasp
    environment: Environment
    fiducials_m: tuple[Vector, ...]

    def __post_init__(self) -> None:
        check_name(self.phantom_id, "phantom_id")


@dataclass(frozen=True, slots=True)
class Rig:
    """Everything that a session needs to know before it begins.

    ``stereo_calibration`` is the file of the two cameras' calibration, ``cameras`` are left and right of it, and
    ``vision`` says what their images show. ``calibration`` is the folder of the calibration files, None for none;
    what is in force there goes before what the rig file says (:mod:`daq.calibration_files.in_force`).
    ``laboratory_clock`` is the file of an emulated laboratory's clock (:mod:`daq.timing.laboratory_time`), and None for
    real devices.
    """

    format: str
    name: str
    stereo_calibration: Path
    force_sensor: Device
    robot: Device
    cameras: tuple[CameraDevice, CameraDevice]
    frames: Frames
    tool: Tool
    limits: Limits
    specimen: Specimen
    uncertainty: Uncertainty = field(default_factory=Uncertainty)
    latencies: Latencies = field(default_factory=Latencies)
    vision: FiducialSettings = field(default_factory=FiducialSettings)
    calibration: Path | None = None
    laboratory_clock: Path | None = None


def read_rig(path: Path) -> Rig:
    """Read a rig file.

    Raises
    ------
    RigError
        Naming file, line and key, and what is allowed there.
    """
    file = TomlFile.read(path)
    if file.root.get("format") != FORMAT:
        raise file.mistake(("format",), f'must be "{FORMAT}", not {file.root.get("format")!r}')
    rig = file.build(Rig, file.root)
    if rig.cameras[0].name == rig.cameras[1].name:
        raise file.mistake(
            ("cameras", 1, "name"), f"must differ from the first camera's, {rig.cameras[0].name!r}"
        )
    left, right = rig.cameras
    return replace(
        rig,
        force_sensor=_with_settings(file, rig.force_sensor, FORCE_SENSOR, ("force_sensor",)),
        robot=_with_settings(file, rig.robot, ROBOT, ("robot",)),
        cameras=(
            _with_settings(file, left, CAMERA, ("cameras", 0)),
            _with_settings(file, right, CAMERA, ("cameras", 1)),
        ),
    )


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


def _made(device: Device | CameraDevice, role: Role) -> Any:
    driver = role.driver(device.driver)
    if driver is None:
        raise RigError(f"no driver of a {role.words} is called '{device.driver}'; {_to_choose_from(role)}")
    return driver.make(device.settings)


def _with_settings(file: TomlFile, device: D, role: Role, keys: Keys) -> D:
    """Return the device with its settings table turned into the settings of its driver."""
    driver = role.driver(device.driver)
    if driver is None:
        raise file.mistake((*keys, "driver"), f"must be {_to_choose_from(role)}, not {device.driver!r}")
    return replace(device, settings=file.build(driver.settings, device.settings, (*keys, "settings")))


def _to_choose_from(role: Role) -> str:
    return f"one of {', '.join(repr(one.name) for one in installed_drivers(role))}"
