"""The effects of this project, in the order in which they act from the tissue to the recording, and its outsiders."""

from estimator.effects.effect import Effect
from estimator.effects.force.force_axis_gain import (
    ForceAxisGain,
    ForceAxisGainOfEach,
    ForceBentGain,
    ForceGains,
)
from estimator.effects.force.force_bias import ForceBias, ForceBiasInOne
from estimator.effects.force.force_crosstalk import (
    ForceCrosstalk,
    ForceCrosstalkInTissue,
    ForcePairCrosstalk,
    ForcePairCrosstalkThatBends,
)
from estimator.effects.force.force_drift import ForceDrift, PeriodicDrift
from estimator.effects.force.force_frame_rotation import (
    ForceFrameRotation,
    ForceFrameRotationOfEach,
    ForceFrameThatGives,
)
from estimator.effects.force.time_offset import Filtered, GrowingOffset, TimeOffset, TimeOffsetOfEach
from estimator.effects.force.tool_weight import (
    TiltedGravity,
    ToolWeight,
    ToolWeightAndCentre,
    ToolWeightOfEach,
)
from estimator.effects.force.torque_centre import TorqueCentre, TorqueCentreOfEach, TorqueCentreThatGives
from estimator.effects.motion.gripper_compliance import (
    AxisAndRotationCompliance,
    AxisCompliance,
    GripperCompliance,
    RotationCompliance,
)
from estimator.effects.motion.gripper_slip import CreepingSlip, GripperJump, GripperSlip, SlipByAxis
from estimator.effects.motion.motion_direction import (
    MotionDirection,
    MotionDirectionOfEach,
    PoseDirection,
    TurnDirection,
)
from estimator.effects.motion.motion_scale import (
    AxisScale,
    MotionScale,
    MotionScaleOfEach,
    PoseScale,
    TurnScale,
)
from estimator.effects.motion.robot_backlash import AxisBacklash, RobotBacklash
from estimator.effects.mounting.anchor_compliance import ANCHOR_COMPLIANCE
from estimator.effects.mounting.anchor_debonding import ANCHOR_DEBONDING, ANCHOR_PEELING
from estimator.effects.mounting.grasp_misplacement import GRASP_MISPLACEMENT
from estimator.effects.mounting.gravity_sag import GRAVITY_SAG
from estimator.effects.mounting.platen_friction import PLATEN_FRICTION
from estimator.effects.mounting.support_friction import SUPPORT_FRICTION
from estimator.effects.outside.air_pocket import AirPocket
from estimator.effects.outside.cable import Cable
from estimator.effects.outside.camera_creep import CameraCreep
from estimator.effects.outside.camera_lag import CameraLag
from estimator.effects.outside.camera_shift import CameraShift
from estimator.effects.outside.cut import Cut
from estimator.effects.outside.force_clipping import ForceClipping
from estimator.effects.outside.jammed_joint import JammedJoint
from estimator.effects.outside.lens_distortion import LensDistortion
from estimator.effects.outside.loose_bead import LooseBead
from estimator.effects.outside.modulus_drift import ModulusDrift
from estimator.effects.outside.shrinkage import Shrinkage
from estimator.effects.outside.slanted_view import SlantedView
from estimator.effects.outside.sticky_patch import StickyPatch
from estimator.effects.outside.zero_jump import ZeroJump
from estimator.effects.shared.axes import WRENCH_CHANNELS
from estimator.effects.tissue.anisotropy import ANISOTROPY
from estimator.effects.tissue.inhomogeneity import INHOMOGENEITY
from estimator.effects.tissue.modulus_gradient import MODULUS_GRADIENT
from estimator.effects.tissue.permanent_set import PERMANENT_SET
from estimator.effects.tissue.prestretch import PRESTRETCH
from estimator.effects.tissue.second_invariant import SECOND_INVARIANT
from estimator.effects.tissue.strain_stiffening import STRAIN_STIFFENING
from estimator.effects.tissue.stress_softening import STRESS_SOFTENING
from estimator.effects.tissue.thickness_error import THICKNESS_ERROR
from estimator.effects.tissue.viscoelasticity import VISCOELASTICITY
from estimator.effects.vision.camera_rotation import CAMERA_ROTATION
from estimator.effects.vision.camera_scale import CAMERA_SCALE
from estimator.effects.vision.fiducial_mislabel import (
    FiducialMislabel,
    FiducialMislabelWhereTurned,
)
from estimator.effects.vision.fiducial_misread import (
    FiducialMisread,
    FiducialMisreadFrom,
    FiducialMisreadInPart,
    FiducialMisreadWithin,
)

_TISSUE: tuple[Effect, ...] = (
    *STRAIN_STIFFENING,
    *SECOND_INVARIANT,
    *VISCOELASTICITY,
    *STRESS_SOFTENING,
    PERMANENT_SET,
    *ANISOTROPY,
    *INHOMOGENEITY,
    *MODULUS_GRADIENT,
    *THICKNESS_ERROR,
    *PRESTRETCH,
)
_MOUNTING: tuple[Effect, ...] = (
    *ANCHOR_COMPLIANCE,
    ANCHOR_DEBONDING,
    ANCHOR_PEELING,
    *GRASP_MISPLACEMENT,
    *PLATEN_FRICTION,
)
_SURROUNDINGS: tuple[Effect, ...] = (*SUPPORT_FRICTION, *GRAVITY_SAG)

# From the reported pose to the tissue: first what the robot does, then what the gripper does.
_MOTION: tuple[Effect, ...] = (
    MotionScale(),
    PoseScale(),
    TurnScale(),
    AxisScale(),
    MotionScaleOfEach(MotionScale()),
    MotionDirection(),
    PoseDirection(),
    TurnDirection(),
    MotionDirectionOfEach(MotionDirection()),
    RobotBacklash("translation", "taken_up"),
    RobotBacklash("translation", "centred"),
    RobotBacklash("rotation", "taken_up"),
    RobotBacklash("rotation", "centred"),
    RobotBacklash("translation", "anywhere"),
    RobotBacklash("rotation", "anywhere"),
    AxisBacklash(),
    GripperCompliance(),
    AxisCompliance(),
    RotationCompliance(),
    AxisAndRotationCompliance(),
    GripperSlip(),
    CreepingSlip(),
    SlipByAxis(),
    GripperJump(),
)

# From the tissue's wrench to the recorded one: what pulls at the sensor, its mounting, its bridges, its clock.
_FORCE: tuple[Effect, ...] = (
    ToolWeight(),
    ToolWeightAndCentre(),
    TiltedGravity(),
    ToolWeightOfEach(ToolWeight()),
    TorqueCentre("gripper"),
    TorqueCentre("tissue"),
    TorqueCentreThatGives(),
    TorqueCentreOfEach(TorqueCentre("gripper")),
    ForceFrameRotation(),
    ForceFrameRotation("tissue"),
    ForceFrameThatGives(),
    ForceFrameRotationOfEach(ForceFrameRotation()),
    ForceCrosstalk(),
    ForceCrosstalkInTissue(),
    ForcePairCrosstalk(),
    ForcePairCrosstalkThatBends(),
    *(ForceAxisGain(channel) for channel in WRENCH_CHANNELS),
    ForceGains("sensor"),
    ForceGains("tissue"),
    ForceBentGain(),
    *(ForceAxisGainOfEach(ForceAxisGain(channel)) for channel in WRENCH_CHANNELS),
    ForceBias("sensor"),
    ForceBias("tissue"),
    *(ForceBias("sensor", channel) for channel in WRENCH_CHANNELS),
    ForceBiasInOne(),
    ForceDrift("linear", "sensor"),
    ForceDrift("linear", "tissue"),
    ForceDrift("saturating", "sensor"),
    ForceDrift("saturating", "tissue"),
    ForceDrift("running_on", "sensor"),
    ForceDrift("zeroed_once", "sensor"),
    ForceDrift("power", "sensor"),
    PeriodicDrift(),
    TimeOffset("lag"),
    TimeOffset("lead"),
    Filtered(),
    GrowingOffset("lag"),
    GrowingOffset("lead"),
    TimeOffsetOfEach(TimeOffset("lag")),
    TimeOffsetOfEach(TimeOffset("lead")),
)

# From the beads to their recorded positions: the cameras' frame, then the tracks.
_VISION: tuple[Effect, ...] = (
    *CAMERA_SCALE,
    *CAMERA_ROTATION,
    FiducialMisread(),
    FiducialMisreadWithin(),
    FiducialMisreadFrom(),
    FiducialMisreadInPart(),
    FiducialMislabel(),
    FiducialMislabelWhereTurned(),
)

EFFECTS: tuple[Effect, ...] = (*_TISSUE, *_MOUNTING, *_SURROUNDINGS, *_MOTION, *_FORCE, *_VISION)

# What else happens to a rig, without a label of its own.
OUTSIDERS: tuple[Effect, ...] = (
    CameraLag("camera_lag"),
    CameraLag("camera_lead"),
    LensDistortion("true"),
    LensDistortion("measured"),
    ForceClipping(),
    StickyPatch(),
    AirPocket(),
    Cut(),
    Shrinkage(),
    ModulusDrift(),
    CameraShift(),
    CameraCreep(),
    SlantedView(),
    Cable(),
    ZeroJump(),
    LooseBead(),
    JammedJoint("turn"),
    JammedJoint("travel"),
)
