"""The phantom as a Neo-Hookean body of cubic elements, unlike any mesh that an estimation uses."""

from dataclasses import dataclass

import numpy as np

from daq.rig import Specimen
from daq.virtual_rig.physics.phantom import PhantomState
from estimator.experiment import Experiment, SensorNoise
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.equilibrium.newton import EquilibriumSolver, NewtonSettings
from estimator.fem.equilibrium.observation import observe
from estimator.forward.meshing import mesh_experiment
from estimator.materials import NeoHookean
from estimator.materials.material import Material
from estimator.simulation.simulate import TRUTH_GRADING
from robot_drivers.protocols import Pose

Vector = tuple[float, float, float]

# Forces are exact to 1e-9 N and beads to 1e-12 m, at half of the work; the slopes, which only continue them, to 1e-5.
_NEWTON = NewtonSettings(tolerance=1e-7, tangent_reuse=1e-3)


@dataclass(frozen=True, slots=True)
class FemPhantom:
    """A homogeneous phantom whose beads lie where they were placed.

    Attributes
    ----------
    specimen : geometry, anchors and grasp
    beads : true positions at rest, m
    youngs_modulus : Pa
    poisson_ratio : below 1/2
    grading : sizes of the elements
    """

    specimen: Specimen
    beads: tuple[Vector, ...]
    youngs_modulus: float
    poisson_ratio: float
    grading: Grading = TRUTH_GRADING

    def build(self) -> "FemPhantomSolver":
        """Mesh the phantom."""
        return FemPhantomSolver(self)

    def truth(self) -> dict[str, float]:
        """Return E and ν."""
        return {"youngs_modulus": self.youngs_modulus, "poisson_ratio": self.poisson_ratio}


class FemPhantomSolver:
    """Solves from the last state on."""

    def __init__(self, model: FemPhantom) -> None:
        self._problem = mesh_experiment(_unloaded(model), model.grading, "hex64")
        self._material = Material(NeoHookean(), model.youngs_modulus, model.poisson_ratio)
        self._solver = EquilibriumSolver(self._problem, _NEWTON)
        self._state = self._solver.rest(self._material)

    def solve(self, T_tissue_gripper: Pose) -> PhantomState:
        """Return the equilibrium; raises SolverError where the motion has none."""
        pose = GripperPose.from_quaternion(
            np.array(T_tissue_gripper.position), np.array(T_tissue_gripper.quaternion_wxyz)
        )
        self._state = self._solver.solve(pose, self._material, self._state)
        seen = observe(self._problem, self._state)
        return PhantomState(
            T_tissue_gripper, seen.wrench, seen.fiducials, seen.wrench_by_pose, seen.fiducials_by_pose
        )


def _unloaded(model: FemPhantom) -> Experiment:
    """Return the phantom as an experiment in which nothing happens, for the mesher."""
    specimen = model.specimen
    return Experiment(
        name="virtual phantom",
        phantom_id=specimen.phantom_id,
        order=1,
        phantom=specimen.phantom,
        anchors=specimen.anchors,
        grasp=specimen.grasp,
        trajectory_kind="other",
        environment=specimen.environment,
        sensor=SensorNoise(1.0, 1.0, 1.0, 1.0),
        fiducials_rest=np.array(model.beads),
        time=np.zeros(1),
        phase=("hold",),
        step=np.zeros(1, dtype=np.int64),
        position=np.array([specimen.grasp.centre]),
        quaternion_wxyz=np.array([[1.0, 0.0, 0.0, 0.0]]),
        wrench=np.zeros((1, 6)),
        fiducials=np.array([model.beads]),
        rollers=specimen.rollers,
    )
