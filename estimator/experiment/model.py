"""What one retraction of one phantom is: stated facts and synchronised observations.

SI units, in the tissue frame: right-handed, fixed to the table, z up, origin at the phantom's centre at rest.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from estimator.experiment.holds import Box, FloatArray, Grasp, Prescribed, Roller, Vector
from estimator.surfaces.units import Unit

Shape = Literal["block", "surface"]
TrajectoryKind = Literal["pull", "gradual_tangent_pull", "twist_and_pull", "other"]
SurfaceBelow = Literal["table", "none"]
Weight = Literal["left_out", "acts", "acts_after_first_row"]
ForceZero = Literal["first_row", "no_load"]
FirstRow = Literal["at_rest", "under_load"]
Driven = Literal["pose", "load"]

FORMAT = "retraction-experiment/2"
FORMATS: tuple[str, ...] = ("retraction-experiment/1", FORMAT)
"""Those that can be read; the last is the one that is written."""
EXPERIMENT_FILE = "experiment.toml"
OBSERVATIONS_FILE = "observations.csv"
SURFACE_FILES: tuple[str, ...] = ("phantom.stl", "phantom.ply", "phantom.obj", "phantom.vtp", "phantom")
"""How the file of a surface may be called in a folder that is written: by its suffix, the last without one."""

PAINTING_PREFIX = "painted_"
"""With which the files of painted patches begin in a folder that is written."""

REGION_PREFIX = "region_"
"""With which the files of regions begin in a folder that is written."""

WRENCH_CHANNELS: tuple[str, ...] = ("fx", "fy", "fz", "tx", "ty", "tz")
BEAD_CHANNELS: tuple[str, ...] = ("x", "y", "z")
PHASES: tuple[str, ...] = ("ramp", "hold", "return", "return_hold")
TRAJECTORY_KINDS: tuple[str, ...] = get_args(TrajectoryKind)


@dataclass(frozen=True, slots=True)
class TissueRegion:
    """A part of the phantom that is stiffer or softer than the rest.

    Attributes
    ----------
    name : of letters, digits, _ and -
    surface : its closed surface, STL, PLY, OBJ or VTP file, in the same frame as the phantom's
    modulus_ratio : of its Young's modulus to that of the rest
    unit : of the file; None as for the phantom's
    """

    name: str
    surface: Path
    modulus_ratio: float
    unit: Unit | None = None

    @property
    def file_name(self) -> str:
        """How its file is called in a folder that is written."""
        return f"{REGION_PREFIX}{self.name}{self.surface.suffix.lower()}"


@dataclass(frozen=True, slots=True)
class Phantom:
    """The body at rest.

    Attributes
    ----------
    shape : ``"block"``, or ``"surface"`` for a closed triangulated surface
    size_m : edges of the block, or of the surface's bounding box, m
    surface : STL, PLY, OBJ or VTP file; None for a block
    density : kg/m³
    unit : of the surface file; None for metres, or millimetres where only these give a phantom
    regions : parts of a surface's tissue with another modulus; where they share tissue, their ratios multiply
    stays_flat : whether a block that is a thin sheet stays in its plane, as skin on a body or a membrane that is drawn
        tight: its middle plane, at right angles to the shortest edge, moves in itself alone, and its stress is plane.
        None where nothing is stated: a thin sheet that would wrinkle is supposed to
    """

    shape: Shape
    size_m: Vector
    surface: Path | None = None
    density: float = 1070.0
    unit: Unit | None = None
    regions: tuple[TissueRegion, ...] = ()
    stays_flat: bool | None = None


@dataclass(frozen=True, slots=True)
class SensorNoise:
    """Standard deviation of the noise of one value in one row, and the tool that is already compensated.

    Attributes
    ----------
    force_std : N
    torque_std : N·m
    fiducial_std : m, each coordinate
    position_std : m, the gripper's reported position
    orientation_std : rad, its reported turn about each axis
    tool_mass : kg beyond the sensor
    tool_centre : its centre of mass in the gripper frame, m
    by_channel : of single channels that differ from these, by name: ``fx`` to ``tz``, and ``x y z`` of every fiducial
    force_zero : where force and torque are zero: ``"first_row"``, whatever pulled at the gripper then, or ``"no_load"``
        where no tissue does, so that they are absolute
    """

    force_std: float
    torque_std: float
    fiducial_std: float
    position_std: float
    tool_mass: float = 0.0
    tool_centre: Vector = (0.0, 0.0, 0.0)
    by_channel: Mapping[str, float] = field(default_factory=dict)
    force_zero: ForceZero = "first_row"
    orientation_std: float = 0.0

    @property
    def pose_std(self) -> FloatArray:
        """Of the gripper's reported position and turn about each axis (6,), m and rad."""
        return np.repeat([self.position_std, self.orientation_std], 3)

    @property
    def wrench_std(self) -> FloatArray:
        """Of the six components of the wrench (6,), N and N·m."""
        usual = [self.force_std] * 3 + [self.torque_std] * 3
        return np.array([self.by_channel.get(*one) for one in zip(WRENCH_CHANNELS, usual, strict=True)])

    @property
    def bead_std(self) -> FloatArray:
        """Of the three coordinates of a fiducial (3,), m."""
        return np.array([self.by_channel.get(axis, self.fiducial_std) for axis in BEAD_CHANNELS])


@dataclass(frozen=True, slots=True)
class Environment:
    """What surrounds the phantom.

    Attributes
    ----------
    gravity : in the tissue frame, m/s²
    surface_below : what the phantom lies on, a table at z = −size_m[2]/2
    weight : whether the phantom's weight strains it: ``"left_out"`` where it is carried or negligible; ``"acts"`` in
        every row; ``"acts_after_first_row"`` where the first row is of the phantom free of stress, as in its mould
    """

    gravity: Vector = (0.0, 0.0, -9.81)
    surface_below: SurfaceBelow = "table"
    weight: Weight = "left_out"


@dataclass(frozen=True, slots=True, eq=False)
class Experiment:
    """One synchronised retraction with n rows and m fiducials. NaN stands for a value that was not measured.

    Attributes
    ----------
    name : free text
    phantom_id : experiments with the same id are of one phantom in one mounting
    order : 1 for the first experiment on that mounting
    phantom, grasp, environment, sensor : as their types say
    anchors : tissue in any of these boxes does not move
    trajectory_kind : one of ``TRAJECTORY_KINDS``
    fiducials_rest : (m, 3) at rest, m
    time : (n,) since the first row, ascending, s
    phase : n of ``PHASES``
    step : (n,) number of the retraction step, 0 at rest
    position : (n, 3) origin of the gripper frame, m
    quaternion_wxyz : (n, 4) its orientation, unit, scalar first, identity at rest
    wrench : (n, 6) force (N) that the tissue exerts on the gripper, and its torque (N·m) about the gripper
        frame's present origin
    fiducials : (n, m, 3) m
    path : the folder it was read from; None where it was made in memory
    first_row : ``"at_rest"``, or ``"under_load"`` where the gripper has moved already: poses are from rest all the same
    driven : by the ``"pose"`` of the gripper, or by the ``"load"`` on it: it is free then, as under a hung weight, and
        its pose is what was measured
    rollers : tissue in any of these boxes does not move along some of the axes
    prescribed : tissue in any of these boxes moves along some of the axes as the fiducials there were seen to
    """

    name: str
    phantom_id: str
    order: int
    phantom: Phantom
    anchors: tuple[Box, ...]
    grasp: Grasp
    trajectory_kind: TrajectoryKind
    environment: Environment
    sensor: SensorNoise
    fiducials_rest: FloatArray
    time: FloatArray
    phase: tuple[str, ...]
    step: NDArray[np.int64]
    position: FloatArray
    quaternion_wxyz: FloatArray
    wrench: FloatArray
    fiducials: FloatArray
    path: Path | None = None
    first_row: FirstRow = "at_rest"
    driven: Driven = "pose"
    rollers: tuple[Roller, ...] = ()
    prescribed: tuple[Prescribed, ...] = ()

    @property
    def directed(self) -> tuple[Roller | Prescribed, ...]:
        """What holds the phantom along some axes, and what leads it there."""
        return (*self.rollers, *self.prescribed)

    @property
    def specific_weight(self) -> FloatArray:
        """The weight that strains the phantom, (3,), N/m³; zero where it is left out."""
        if self.environment.weight == "left_out":
            return np.zeros(3)
        return self.phantom.density * np.asarray(self.environment.gravity)

    @property
    def zeroed_under_load(self) -> bool:
        """Whether the first row, in which force and torque count as zero, has the tissue pull at the gripper."""
        weight = self.environment.weight
        loaded = weight == "acts" or (weight == "left_out" and self.first_row == "under_load")
        return loaded and self.sensor.force_zero == "first_row"
