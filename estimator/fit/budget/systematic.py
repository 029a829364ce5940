"""Errors that stay the same throughout the experiments of one mounting: of calibrations, clocks and geometry.

Each is made of effects of the catalogue. Where an effect has several amplitudes, such as the turns about three axes,
they are independent of each other; where an error is several effects together, as one gain of six axes, they are one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

from estimator.effects.effect import Effect, Values
from estimator.effects.force.force_axis_gain import ForceAxisGain
from estimator.effects.force.force_crosstalk import ForceCrosstalk
from estimator.effects.force.force_frame_rotation import ForceFrameRotation
from estimator.effects.force.time_offset import TimeOffset
from estimator.effects.force.tool_weight import ToolWeight
from estimator.effects.force.torque_centre import TorqueCentre
from estimator.effects.motion.motion_direction import MotionDirection
from estimator.effects.motion.motion_scale import MotionScale
from estimator.effects.mounting.grasp_misplacement import GRASP_EDGES
from estimator.effects.outside.camera_lag import CameraLag
from estimator.effects.shared.axes import WRENCH_CHANNELS
from estimator.effects.tissue.thickness_error import THICKNESS_ERROR
from estimator.effects.vision.camera_rotation import CameraRotation
from estimator.effects.vision.camera_scale import CameraScale
from estimator.errors import InputError
from estimator.fit.budget.source import Device, Origin
from estimator.fit.nuisances import GAIN_STD

Acting = tuple[Effect, Values]


@dataclass(frozen=True, slots=True)
class Systematic:
    """An error that the model does not have.

    Attributes
    ----------
    name : as options and files call it
    words : as people do
    device : whose it is
    unit : of its size, SI; "1" for a share
    assumed : standard uncertainty where nobody states another
    because : why that
    directions : independent components, of each what acts at unit size: effects with the name of an amplitude
    under_way : whether only what was measured while the gripper moved has it
    """

    name: str
    words: str
    device: Device
    unit: str
    assumed: float
    because: str
    directions: tuple[tuple[tuple[Effect, str], ...], ...]
    under_way: bool = False

    @property
    def mechanical(self) -> bool:
        """Whether it changes the mechanics, and not only motion and readings."""
        return any("problem" in effect.acts_on for direction in self.directions for effect, _ in direction)

    def acting(self, size: float) -> list[list[Acting]]:
        """Return for each component what acts at a size."""
        return [
            [(effect, _one_of(effect, amplitude, size)) for effect, amplitude in direction]
            for direction in self.directions
        ]


@dataclass(frozen=True)
class Stated:
    """What is known of uncertainties beyond what an experiment states.

    Attributes
    ----------
    sizes : standard uncertainties of ``SYSTEMATIC`` by name, SI, in place of those that are assumed
    origins : where sizes come from, by name of these or of ``NOISE``

    Raises
    ------
    InputError
        A name is unknown, or a size is negative or no number.
    """

    sizes: Mapping[str, float] = field(default_factory=dict)
    origins: Mapping[str, Origin] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, size in self.sizes.items():
            if name not in SYSTEMATIC:
                raise InputError(f"no uncertainty is called '{name}'; there are {', '.join(SYSTEMATIC)}")
            if not 0.0 <= size < float("inf"):
                raise InputError(f"uncertainty {name} = {size:g}: write a number that is not negative")
        for name in self.origins:
            if name not in SYSTEMATIC and name not in NOISE:
                raise InputError(
                    f"no uncertainty is called '{name}'; there are {', '.join((*SYSTEMATIC, *NOISE))}"
                )

    def size_of(self, one: Systematic) -> float:
        """Return the standard uncertainty of an error."""
        return self.sizes.get(one.name, one.assumed)

    def origin_of(self, one: Systematic) -> Origin:
        """Return where it comes from."""
        if one.name in self.origins:
            return self.origins[one.name]
        return Origin("B", "stated" if one.name in self.sizes else f"assumed: {one.because}")


NOISE: Mapping[str, Origin] = MappingProxyType(
    dict.fromkeys(
        ("force", "torque", "bead", "position", "orientation"),
        Origin("A", "scatter, as experiment.toml states it"),
    )
)
"""What a row carries of noise, and where its size comes from if nobody says otherwise."""


def _each(effect: Effect, amplitudes: Sequence[str] = ()) -> tuple[tuple[tuple[Effect, str], ...], ...]:
    """Return the amplitudes of an effect, or those that are named, as independent components."""
    names = amplitudes or [amplitude.name for amplitude in effect.amplitudes]
    return tuple(((effect, name),) for name in names)


def _one_of(effect: Effect, amplitude: str, size: float) -> dict[str, float]:
    return {**{one.name: 0.0 for one in effect.amplitudes}, amplitude: size}


FORCE_GAIN = Systematic(
    "force_gain",
    "force gain",
    "force sensor",
    "1",
    GAIN_STD,
    "accuracy of a six-axis transducer",
    (tuple((ForceAxisGain(channel), "gain") for channel in WRENCH_CHANNELS),),
)
TORQUE_CENTRE = Systematic(
    TorqueCentre.label,
    "origin of the gripper in the force sensor",
    "force sensor",
    "m",
    5e-4,
    "measured with a calliper",
    _each(TorqueCentre("gripper")),
)
MOTION_DIRECTION = Systematic(
    MotionDirection.label,
    "direction of the gripper's motion",
    "robot",
    "rad",
    3e-3,
    "registration of robot and tissue",
    _each(MotionDirection()),
)
CAMERA_SCALE = Systematic(
    CameraScale.label,
    "camera scale",
    "cameras",
    "1",
    1e-3,
    "pitch of a printed board",
    _each(CameraScale("of_the_motion", "motion")),
)
GRIPPER_TRAVEL = Systematic(
    "gripper_travel",
    "gripper travel",
    "robot",
    "1",
    2e-3,
    "20 µm in 10 mm",
    _each(MotionScale()),
)

SYSTEMATIC: Mapping[str, Systematic] = MappingProxyType(
    {
        one.name: one
        for one in (
            FORCE_GAIN,
            Systematic(
                ForceCrosstalk.label,
                "force cross-talk",
                "force sensor",
                "1",
                5e-3,
                "half a per cent of full scale, each axis into each",
                _each(ForceCrosstalk()),
            ),
            Systematic(
                "force_rotation",
                "rotation of the force sensor",
                "force sensor",
                "rad",
                5e-3,
                "a bolt pattern's play",
                _each(ForceFrameRotation()),
            ),
            TORQUE_CENTRE,
            Systematic(
                "tool_mass",
                "mass beyond the force sensor",
                "force sensor",
                "kg",
                5e-3,
                "a kitchen balance",
                _each(ToolWeight()),
            ),
            GRIPPER_TRAVEL,
            MOTION_DIRECTION,
            CAMERA_SCALE,
            Systematic(
                CameraRotation.label,
                "rotation of the cameras",
                "cameras",
                "rad",
                2e-3,
                "registration of cameras and tissue",
                _each(CameraRotation("of_the_motion", "motion")),
            ),
            Systematic(
                "force_latency",
                "latency of the force",
                "clocks",
                "s",
                5e-3,
                "a filter that nobody has measured",
                _each(TimeOffset("lag")),
                under_way=True,
            ),
            Systematic(
                "camera_latency",
                "latency of the images",
                "clocks",
                "s",
                1e-2,
                "half an exposure and its transfer",
                _each(CameraLag("camera_lag")),
                under_way=True,
            ),
            Systematic(
                "thickness",
                "thickness of the phantom",
                "specimen",
                "1",
                1e-2,
                "0.1 mm in 10 mm, a calliper on something soft",
                _each(THICKNESS_ERROR[0]),
            ),
            Systematic(
                "grasp_edges",
                "place of the grasp",
                "specimen",
                "m",
                3e-4,
                "a mark under the jaws",
                _each(GRASP_EDGES[0]),
            ),
            Systematic(
                "grasp_turn",
                "turn of the grasp",
                "specimen",
                "rad",
                1e-2,
                "a mark under the jaws",
                _each(GRASP_EDGES[1]),
            ),
        )
    }
)
"""All of them by name."""
