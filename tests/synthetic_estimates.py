"""Estimates made up for the tests of what is shown of them: no mechanics, only a bar that stretches evenly."""

import numpy as np

from estimator.experiment import Box, Environment, Experiment, Grasp, Phantom, SensorNoise
from estimator.fem.discretisation.block_mesh import structured_mesh
from estimator.fem.discretisation.elements import ElementKind
from estimator.fem.discretisation.mesh import Mesh
from estimator.fit.budget.budget import Budget
from estimator.fit.budget.components import Component
from estimator.fit.budget.evaluation import budget_of
from estimator.fit.budget.source import Origin, Source
from estimator.fit.result import Estimate, ExperimentFit, ParameterEstimate, Rmse
from estimator.fit.search import Iterate
from estimator.inference.material_parameters import POISSON_RATIO, YOUNGS_MODULUS
from estimator.report.estimation.findings import Truth

TRUTH = Truth(20_100.0, 0.46)
SENSOR = SensorNoise(force_std=0.02, torque_std=5e-4, fiducial_std=5e-5, position_std=3e-5)
REST = np.array([[-0.03, -0.02, 0.01], [0.0, 0.01, 0.01], [0.02, 0.0, 0.01]])
PULL_M = 0.01


def block(kind: ElementKind = "hex27") -> Mesh:
    x = np.linspace(-0.05, 0.05, 5)
    y = np.linspace(-0.04, 0.04, 3)
    return structured_mesh([x, y, np.array([-0.01, 0.01])], kind)


def stretched(points: np.ndarray, pull: float) -> np.ndarray:
    """Displacement of a bar whose end x = −50 mm is held and whose other end is pulled by ``pull``, m."""
    moved = np.zeros_like(points)
    moved[:, 0] = pull * (points[:, 0] + 0.05) / 0.1
    return moved


def at_its_end(points: np.ndarray, rows: int) -> tuple[np.ndarray, np.ndarray]:
    """One state, fully stretched, for every row."""
    return stretched(points, PULL_M)[None], np.zeros(rows, dtype=np.int64)


def pull_fit(name: str = "pull", *, noise: float = 1.0, rows: int = 40, seed: int = 1) -> ExperimentFit:
    """A pull with residuals of ``noise`` times the sensors' stated noise."""
    generator = np.random.default_rng(seed)
    way = np.interp(np.arange(rows), [0, rows // 2, rows - 1], [0.0, PULL_M, 0.0])
    wrench = np.outer(way / PULL_M, [-2.0, 0.1, 0.0, 0.0, 0.005, 0.03])
    fiducials = REST + np.array([stretched(REST, pull) for pull in way])
    wrench_noise = generator.standard_normal(wrench.shape) * (
        [SENSOR.force_std] * 3 + [SENSOR.torque_std] * 3
    )
    fiducial_noise = generator.standard_normal(fiducials.shape) * SENSOR.fiducial_std
    experiment = Experiment(
        name=name,
        phantom_id="bar <1>",
        order=1,
        phantom=Phantom("block", (0.1, 0.08, 0.02)),
        anchors=(Box((-0.051, -0.041, -0.011), (-0.049, 0.041, 0.011)),),
        grasp=Grasp(Box((0.025, -0.02, -0.011), (0.051, 0.02, 0.011)), (0.04, 0.0, 0.0)),
        trajectory_kind="pull",
        environment=Environment(),
        sensor=SENSOR,
        fiducials_rest=REST,
        time=0.5 * np.arange(rows),
        phase=("hold",) + ("ramp", "hold") * (rows // 4) + ("return",) * (rows - 1 - 2 * (rows // 4)),
        step=np.arange(rows),
        position=np.array([0.04, 0.0, 0.0]) + np.outer(way, [1.0, 0.0, 0.0]),
        quaternion_wxyz=np.tile([1.0, 0.0, 0.0, 0.0], (rows, 1)),
        wrench=wrench + noise * wrench_noise,
        fiducials=fiducials + noise * fiducial_noise,
    )
    wrench_std = np.broadcast_to([SENSOR.force_std] * 3 + [SENSOR.torque_std] * 3, wrench.shape)
    fiducials_std = np.full(fiducials.shape, SENSOR.fiducial_std)
    displacements, state_of_row = at_its_end(block().points, rows)
    return ExperimentFit(
        experiment, wrench, fiducials, displacements, state_of_row, wrench_std, fiducials_std
    )


def estimate_of(*fits: ExperimentFit) -> Estimate:
    return Estimate(
        youngs_modulus=ParameterEstimate(20_000.0, 120.0, (19_766.2, 20_236.6)),
        poisson_ratio=ParameterEstimate(0.4512, 0.0021, (0.4469, 0.4553)),
        correlation=-0.31,
        rmse=Rmse(0.0197, 4.9e-4, 5.1e-5),
        noise_ratio=1.02,
        inflation=1.02,
        iterates=(
            Iterate({"youngs_modulus": 15_000.0, "poisson_ratio": 0.4}, 900.0),
            Iterate({"youngs_modulus": 19_800.0, "poisson_ratio": 0.45}, 120.0),
            Iterate({"youngs_modulus": 20_000.0, "poisson_ratio": 0.4512}, 480.0),
        ),
        forward_solves=57,
        seconds=12.34,
        mesh=block(),
        discretisation_force=0.004,
        fits=fits,
    )


def made_up_budget() -> Budget:
    """A budget of E and ν with noise that the fit knows of, a gain that it does not, and an error of no consequence."""
    scatter, assumed = Origin("A", "scatter"), Origin("B", "assumed: a guess")
    modulus, ratio = YOUNGS_MODULUS.at(20_000.0), POISSON_RATIO.at(0.45)
    return budget_of(
        (modulus, ratio),
        [
            Component(
                Source("bead", "noise of the beads", "cameras", 5e-5, "m", scatter, known=True),
                np.array([[3e-4, 0.0], [0.0, 0.04]]),
            ),
            Component(
                Source("force_gain", "force gain", "force sensor", 0.01, "1", assumed, known=False),
                np.array([[0.01], [0.0]]),
            ),
            Component(
                Source(
                    "tool_mass",
                    "mass beyond the force sensor",
                    "force sensor",
                    5e-3,
                    "kg",
                    assumed,
                    known=False,
                ),
                np.zeros((2, 1)),
            ),
        ],
    )
