"""The virtual experiments of the studies: the block, its three retractions, and what is measured on it.

Block, grasp and steps are those of the paper's section IV-A. It gives no angles; those are the laboratory's usual ones.
Nothing carries noise, so that what an estimate is off by comes from the cause that a study looks at alone. The stated
deviations of the sensors say how the estimate weighs them.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.experiment import Box, Environment, Experiment, Grasp, Phantom, SensorNoise
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.newton import NewtonSettings
from estimator.forward.model import ForwardModel
from estimator.materials import NeoHookean
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

YOUNGS_MODULUS = 15e3
POISSON_RATIO = 0.49
TRUTH = Material(NeoHookean(), YOUNGS_MODULUS, POISSON_RATIO)
SIZE_M = (0.10, 0.10, 0.01)
GRASP_CENTRE = (0.04, 0.0, 0.0)
_GRASP_HALF_M = (0.01, 0.01)
_BEAD_ROWS_M = (-0.03, -0.01, 0.01, 0.03)
WITHOUT_DERIVATIVES = NewtonSettings(tangent_reuse=np.inf)
SENSOR = SensorNoise(force_std=0.02, torque_std=5e-4, fiducial_std=5e-5, position_std=3e-5)


@dataclass(frozen=True, slots=True)
class Motion:
    """Equal steps along +x while turning about one axis through the gripper's origin."""

    steps: int
    step_m: float
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    angle_rad: float = 0.0

    @property
    def angle_deg(self) -> float:
        """How far it turns, in degrees."""
        return math.degrees(self.angle_rad)

    def poses(self, centre: Sequence[float] = GRASP_CENTRE) -> list[GripperPose]:
        """Return the pose at rest and after every step."""
        turn = self.angle_rad * np.array(self.axis)
        return [
            GripperPose(
                np.add(centre, (step * self.step_m, 0.0, 0.0)),
                Rotation.from_rotvec(step / self.steps * turn),
            )
            for step in range(self.steps + 1)
        ]


def _tangent(degrees: float) -> Motion:
    return Motion(20, 1e-3, (0.0, 0.0, 1.0), math.radians(degrees))


def _twist(degrees: float) -> Motion:
    return Motion(10, 2e-3, (1.0, 0.0, 0.0), math.radians(degrees))


# The first three are the usual ones; the others read the angles, which the paper does not give, otherwise.
MOTIONS = {
    "pull": Motion(10, 2e-3),
    "gradual_tangent_pull": _tangent(30.0),
    "twist_and_pull": _twist(45.0),
    "tangent_15": _tangent(15.0),
    "tangent_60": _tangent(60.0),
    "twist_20": _twist(20.0),
    "twist_90": _twist(90.0),
}


def grasp_at(shift_m: tuple[float, float]) -> Grasp:
    """Return the block's grasp, shifted in the plane; it reaches through the whole thickness."""
    x, y = GRASP_CENTRE[0] + shift_m[0], GRASP_CENTRE[1] + shift_m[1]
    (along, across), half = _GRASP_HALF_M, SIZE_M[2] / 2
    box = Box((x - along, y - across, -half), (x + along, y + across, half))
    return Grasp(box, (x, y, 0.0))


def block(poses: Sequence[GripperPose], grasp: Grasp | None = None) -> Experiment:
    """Return the block with nothing measured yet, its left face anchored, one row for each pose."""
    half = np.array(SIZE_M) / 2
    anchor = Box((-half[0], -half[1], -half[2]), (-half[0], half[1], half[2]))
    beads = grid_of_beads(float(half[2]))
    return unmeasured(Phantom("block", SIZE_M), (anchor,), grasp or grasp_at((0.0, 0.0)), beads, poses)


def grid_of_beads(height_m: float) -> FloatArray:
    """Return the 4 × 4 beads (16, 3) at a height above the middle, m."""
    return np.array([(x, y, height_m) for x in _BEAD_ROWS_M for y in _BEAD_ROWS_M])


def unmeasured(
    phantom: Phantom,
    anchors: tuple[Box, ...],
    grasp: Grasp,
    beads: FloatArray,
    poses: Sequence[GripperPose],
) -> Experiment:
    """Return a retraction with nothing measured yet, one row for each pose, a second apart; beads (m, 3), m."""
    rows = len(poses)
    return Experiment(
        name="virtual",
        phantom_id="virtual",
        order=1,
        phantom=phantom,
        anchors=anchors,
        grasp=grasp,
        trajectory_kind="other",
        environment=Environment(),
        sensor=SENSOR,
        fiducials_rest=beads,
        time=np.arange(rows, dtype=float),
        phase=("hold",) * rows,
        step=np.arange(rows),
        position=np.array([pose.position for pose in poses]),
        quaternion_wxyz=np.array([pose.rotation.as_quat(scalar_first=True) for pose in poses]),
        wrench=np.zeros((rows, 6)),
        fiducials=np.tile(beads, (rows, 1, 1)),
    )


def measured(experiment: Experiment, problem: RetractionProblem, material: Material = TRUTH) -> Experiment:
    """Return the experiment with what perfect sensors read where ``problem`` and ``material`` are the truth.

    Raises
    ------
    SolverError
        The motion has no equilibrium.
    """
    model = ForwardModel(problem, [experiment])
    schedule = model.schedules[0]
    seen = model.predict(material, [range(len(schedule.poses))], newton=WITHOUT_DERIVATIVES)[0]
    return replace(
        experiment,
        wrench=np.array([seen[state].wrench for state in schedule.state_of_row]),
        fiducials=np.array([seen[state].fiducials for state in schedule.state_of_row]),
    )
