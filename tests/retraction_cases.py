"""Retractions of blocks that the tests of the mechanics and of the fit share."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.experiment import Box, Environment, Experiment, Grasp, Phantom, SensorNoise
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.equilibrium.newton import EquilibriumSolver, NewtonSettings
from estimator.fem.equilibrium.observation import Observation
from estimator.fem.equilibrium.state import EquilibriumState
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

# A third of the default mesh's unknowns: for what holds on every mesh.
COARSE_GRADING = Grading(grasp_m=4e-3, anchor_m=8e-3, largest_m=20e-3, growth=2.0, layers=1)


def block_at_rest(
    size: tuple[float, float, float], grasp: Box, sensor: SensorNoise, fiducials: FloatArray
) -> Experiment:
    """A block whose face at lowest x is anchored, in one row before any motion."""
    half = np.array(size) / 2
    centre = (np.array(grasp.lower) + grasp.upper) / 2
    return Experiment(
        name="block",
        phantom_id="P01",
        order=1,
        phantom=Phantom("block", size),
        anchors=(Box(tuple(-half), (-half[0], half[1], half[2])),),
        grasp=Grasp(grasp, tuple(centre)),
        trajectory_kind="other",
        environment=Environment(),
        sensor=sensor,
        fiducials_rest=fiducials,
        time=np.zeros(1),
        phase=("hold",),
        step=np.zeros(1, dtype=np.int64),
        position=centre[None],
        quaternion_wxyz=np.array([[1.0, 0.0, 0.0, 0.0]]),
        wrench=np.zeros((1, 6)),
        fiducials=fiducials[None],
    )


_ROWS_MM = (-30.0, -10.0, 10.0, 30.0)
# The block of the reference solutions: tests/data/reference/README.md.
REFERENCE_BLOCK = block_at_rest(
    (0.10, 0.10, 0.01),
    Box((0.03, -0.01, -0.005), (0.05, 0.01, 0.005)),
    SensorNoise(force_std=0.02, torque_std=5e-4, fiducial_std=5e-5, position_std=3e-5),
    1e-3 * np.array([(x, y, 5.0) for x in _ROWS_MM for y in _ROWS_MM]),
)

# Small, so that a whole estimation is a matter of a second or two; gripped over its whole width.
SMALL_BLOCK = block_at_rest(
    (0.06, 0.03, 0.01),
    Box((0.018, -0.015, -0.005), (0.03, 0.015, 0.005)),
    SensorNoise(force_std=0.02, torque_std=5e-4, fiducial_std=5e-5, position_std=3e-5),
    1e-3 * np.array([(x, y, 5.0) for x in (-18.0, -6.0, 6.0) for y in (-9.0, 0.0, 9.0)]),
)


def straight_pull(rest: Experiment, length_m: float, steps: int) -> list[GripperPose]:
    """Along +x in equal steps; the pose at rest is not among them."""
    return turning_pull(rest, length_m, np.zeros(3), steps)


def turning_pull(rest: Experiment, length_m: float, turn_rad: FloatArray, steps: int) -> list[GripperPose]:
    """Along +x while turning at a constant rate to the rotation vector ``turn_rad``."""
    way = np.linspace(0.0, 1.0, steps + 1)[1:]
    start = np.array(rest.grasp.centre)
    return [
        GripperPose(start + s * np.array([length_m, 0.0, 0.0]), Rotation.from_rotvec(s * turn_rad))
        for s in way
    ]


# Names and angles as in the reference energies: tests/data/reference/README.md.
REFERENCE_PATHS = {
    "pull": straight_pull(REFERENCE_BLOCK, 0.02, 10),
    "gradual_tangent_pull": turning_pull(REFERENCE_BLOCK, 0.02, np.radians([0.0, 0.0, 30.0]), 20),
    "twist_and_pull": turning_pull(REFERENCE_BLOCK, 0.02, np.radians([45.0, 0.0, 0.0]), 10),
}


def from_rest(rest: Experiment, path: Sequence[GripperPose]) -> list[GripperPose]:
    """The path with the pose at rest before it."""
    return [GripperPose(np.array(rest.grasp.centre), Rotation.identity()), *path]


def follow(
    problem: RetractionProblem,
    material: Material,
    poses: Sequence[GripperPose],
    settings: NewtonSettings | None = None,
) -> list[EquilibriumState]:
    """Solve the poses one after the other, from rest; the state at rest is not among those returned."""
    solver = EquilibriumSolver(problem, settings)
    states = [solver.rest(material)]
    for pose in poses:
        states.append(solver.solve(pose, material, states[-1]))
    return states[1:]


def with_rows(
    rest: Experiment, poses: Sequence[GripperPose], wrench: FloatArray, fiducials: FloatArray
) -> Experiment:
    """An experiment with one row a pose, one second apart."""
    rows = len(poses)
    return replace(
        rest,
        time=np.arange(rows, dtype=float),
        phase=("hold",) * rows,
        step=np.arange(rows),
        position=np.array([pose.position for pose in poses]),
        quaternion_wxyz=np.array([pose.rotation.as_quat(scalar_first=True) for pose in poses]),
        wrench=wrench,
        fiducials=fiducials,
    )


def recorded(
    rest: Experiment,
    poses: Sequence[GripperPose],
    seen: Sequence[Observation],
    rng: np.random.Generator,
    rows: int = 4,
    noise: float = 1.0,
) -> Experiment:
    """What a laboratory records: so many rows at each pose, each with its sensors' stated noise times ``noise``."""
    sensor = rest.sensor
    repeated = [pose for pose in poses for _ in range(rows)]
    wrench = np.repeat([o.wrench for o in seen], rows, axis=0)
    fiducials = np.repeat([o.fiducials for o in seen], rows, axis=0)
    scatter = np.repeat([sensor.force_std, sensor.torque_std], 3)
    exact = with_rows(rest, repeated, wrench, fiducials)
    return replace(
        exact,
        step=np.repeat(np.arange(len(poses)), rows),
        position=exact.position + noise * sensor.position_std * rng.normal(size=exact.position.shape),
        wrench=wrench + noise * scatter * rng.normal(size=wrench.shape),
        fiducials=fiducials + noise * sensor.fiducial_std * rng.normal(size=fiducials.shape),
    )


def measured_only(
    experiment: Experiment, wrench: Sequence[int], beads: Sequence[int], axes: Sequence[int]
) -> Experiment:
    """The experiment with only these components of the wrench, beads, and coordinates of them."""
    felt = np.full_like(experiment.wrench, np.nan)
    felt[:, list(wrench)] = experiment.wrench[:, list(wrench)]
    seen = np.full_like(experiment.fiducials, np.nan)
    kept = np.ix_(range(len(experiment.time)), beads, axes)
    seen[kept] = experiment.fiducials[kept]
    return replace(experiment, wrench=felt, fiducials=seen)


@st.composite
def with_some_dropped(
    draw: st.DrawFn, whole: Sequence[Experiment], fewest_of_wrench: int = 0
) -> list[Experiment]:
    """Two experiments of nine beads and ten rows, or one of them, with channels, beads and rows left out at random."""
    experiments = draw(st.sampled_from([whole, whole[:1], whole[1:]]))
    wrench = draw(st.lists(st.integers(0, 5), unique=True, min_size=fewest_of_wrench, max_size=6))
    beads = draw(st.lists(st.integers(0, 8), unique=True, max_size=9))
    axes = draw(st.lists(st.integers(0, 2), unique=True, max_size=3))
    rows = draw(st.lists(st.integers(1, 9), unique=True, min_size=1))
    return [of_rows(measured_only(one, wrench, beads, axes), [0, *sorted(rows)]) for one in experiments]


def of_rows(experiment: Experiment, rows: list[int]) -> Experiment:
    """Some rows of an experiment, the first among them."""
    return replace(
        experiment,
        time=experiment.time[rows],
        phase=tuple(experiment.phase[row] for row in rows),
        step=experiment.step[rows],
        position=experiment.position[rows],
        quaternion_wxyz=experiment.quaternion_wxyz[rows],
        wrench=experiment.wrench[rows],
        fiducials=experiment.fiducials[rows],
    )
