"""What the sensors would see: derivatives against re-solved states, work against energy, symmetry and frames."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from retraction_cases import COARSE_GRADING, REFERENCE_BLOCK, REFERENCE_PATHS, follow, turning_pull
from scipy.spatial.transform import Rotation

from estimator.fem.boundary.motion import GripperPose
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.equilibrium.newton import EquilibriumSolver, NewtonSettings
from estimator.fem.equilibrium.observation import Observation, observe
from estimator.fem.equilibrium.state import EquilibriumState
from estimator.forward.meshing import mesh_experiment
from estimator.materials import LAWS, NeoHookean
from estimator.materials.law import Law
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

SMALL = mesh_experiment(
    REFERENCE_BLOCK, Grading(grasp_m=8e-3, anchor_m=15e-3, largest_m=30e-3, growth=2.0, layers=1)
)
EXACT = NewtonSettings(tolerance=1e-13)
NEO_HOOKEAN = Material(NeoHookean(), 15e3, 0.45)
# 12 mm along +x, turned by 27° about an oblique axis.
TWISTED = turning_pull(REFERENCE_BLOCK, 0.012, np.array([0.4, -0.2, 0.15]), 3)
SHAPES = {
    "neo_hookean": [],
    "mooney_rivlin": [0.3],
    "yeoh2": [0.2],
    "yeoh3": [0.1, 0.05],
    "gent": [0.05],
    "arruda_boyce": [0.1],
    "veronda_westmann": [0.5, 0.2],
    "ogden1": [3.0],
    "ogden2": [2.5, -1.5, 0.3],
    "st_venant_kirchhoff": [],
}


def channels(observation: Observation) -> FloatArray:
    return np.concatenate([observation.wrench, observation.fiducials.reshape(-1)])


def twisted_state(material: Material) -> EquilibriumState:
    return follow(SMALL, material, TWISTED, EXACT)[-1]


def resolved(state: EquilibriumState, material: Material, pose: GripperPose) -> FloatArray:
    """Channels of the equilibrium near ``state``."""
    return channels(observe(SMALL, EquilibriumSolver(SMALL, EXACT).solve(pose, material, state)))


def central(function: Callable[[float], FloatArray], step: float) -> FloatArray:
    """Fourth-order central difference quotient at zero."""
    near, far = (function(k * step) - function(-k * step) for k in (1, 2))
    return (8 * near - far) / (12 * step)


def agree(exact: FloatArray, quotient: FloatArray) -> None:
    """To 1e-5 of the largest derivative of force, of torque and of fiducials, each in its own unit."""
    for kind in (slice(0, 3), slice(3, 6), slice(6, None)):
        np.testing.assert_allclose(exact[kind], quotient[kind], atol=1e-5 * np.abs(quotient[kind]).max())


def turned(pose: GripperPose, axis: int, angle: float) -> GripperPose:
    return GripperPose(pose.position, Rotation.from_rotvec(angle * np.eye(3)[axis]) * pose.rotation)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS.keys())
def test_derivatives_by_every_material_parameter_are_those_of_solved_states(law: Law) -> None:
    shape = np.array(SHAPES[law.name])
    material = Material(law, 15e3, 0.45, shape)
    state = twisted_state(material)
    seen = observe(SMALL, state)

    def with_shape(n: int, change: float) -> Material:
        return replace(material, shape=shape + change * np.eye(len(shape))[n])

    variations: dict[str, tuple[float, Callable[[float], Material]]] = {
        "youngs_modulus": (50.0, lambda change: replace(material, youngs_modulus=15e3 + change)),
        "poisson_ratio": (5e-4, lambda change: replace(material, poisson_ratio=0.45 + change)),
    }
    for n, parameter in enumerate(law.shape_parameters):
        variations[parameter.name] = (2e-3, lambda change, n=n: with_shape(n, change))
    assert seen.wrench_by.keys() == seen.fiducials_by.keys() == variations.keys()
    for name, (step, varied) in variations.items():
        quotient = central(lambda change, v=varied: resolved(state, v(change), state.pose), step)
        exact = np.concatenate([seen.wrench_by[name], seen.fiducials_by[name].reshape(-1)])
        if name == "youngs_modulus":
            np.testing.assert_allclose(quotient[6:], 0.0, atol=1e-14)
            quotient[6:] = exact[6:] = 0.0
        agree(exact, quotient)


def test_derivatives_by_the_pose_are_those_of_solved_states() -> None:
    state = twisted_state(NEO_HOOKEAN)
    seen = observe(SMALL, state)
    by_pose = np.concatenate([seen.wrench_by_pose, seen.fiducials_by_pose.reshape(-1, 6)])
    pose = state.pose
    for axis in range(3):

        def shifted(change: float, axis: int = axis) -> FloatArray:
            moved = GripperPose(pose.position + change * np.eye(3)[axis], pose.rotation)
            return resolved(state, NEO_HOOKEAN, moved)

        agree(by_pose[:, axis], central(shifted, 1e-4))
        agree(
            by_pose[:, 3 + axis],
            central(lambda change, a=axis: resolved(state, NEO_HOOKEAN, turned(pose, a, change)), 5e-3),
        )


def test_the_field_by_the_pose_is_that_of_solved_states() -> None:
    """Which the prediction of the next state starts from."""
    state = twisted_state(NEO_HOOKEAN)
    solver = EquilibriumSolver(SMALL, EXACT)

    def field(change: float) -> FloatArray:
        solution = solver.solve(turned(state.pose, 0, change), NEO_HOOKEAN, state)
        return solution.displacement.reshape(-1)[SMALL.pattern.free]

    quotient = central(field, 5e-3)
    np.testing.assert_allclose(state.by_pose[:, 3], quotient, atol=1e-5 * np.abs(quotient).max())


@pytest.mark.parametrize(
    ("path", "reference_j"),
    [("pull", 0.02382), ("gradual_tangent_pull", 0.03270), ("twist_and_pull", 0.02695)],
)
def test_the_work_of_the_wrench_along_the_path_is_the_stored_energy(path: str, reference_j: float) -> None:
    """By the corrected trapezoidal rule; signs, frames and torques would all show."""
    problem = mesh_experiment(REFERENCE_BLOCK, COARSE_GRADING)
    poses = REFERENCE_PATHS[path]
    start = EquilibriumSolver(problem).rest(NEO_HOOKEAN)
    states = [start, *follow(problem, NEO_HOOKEAN, poses)]
    seen = [observe(problem, state) for state in states]
    work = 0.0
    for before, after, a, b in zip(states[:-1], states[1:], seen[:-1], seen[1:], strict=True):
        motion = before.pose.increment_to(after.pose)
        work -= motion @ (a.wrench + b.wrench) / 2
        work -= motion @ (a.wrench_by_pose - b.wrench_by_pose) @ motion / 12
    assert work == pytest.approx(states[-1].response.energy, rel=3e-5)
    assert states[-1].response.energy == pytest.approx(reference_j, rel=0.01)


def test_the_default_mesh_stores_the_reference_energy() -> None:
    problem = mesh_experiment(REFERENCE_BLOCK)
    last = follow(problem, NEO_HOOKEAN, REFERENCE_PATHS["twist_and_pull"])[-1]
    assert last.response.energy == pytest.approx(0.02695, rel=0.002)


def test_young_s_modulus_scales_the_wrench_and_leaves_the_fiducials() -> None:
    soft, stiff = (
        observe(SMALL, follow(SMALL, Material(NeoHookean(), e, 0.45), TWISTED, EXACT)[-1]) for e in (1e3, 3e4)
    )
    np.testing.assert_allclose(30 * soft.wrench, stiff.wrench, rtol=1e-9)
    np.testing.assert_allclose(soft.fiducials, stiff.fiducials, atol=1e-13)


def test_a_mirrored_motion_gives_the_mirrored_observation() -> None:
    """Mirrored at the plane y = 0: forces and points turn over y, torques over x and z."""
    mirrored = [
        GripperPose(p.position, Rotation.from_rotvec(p.rotation.as_rotvec() * [-1.0, 1.0, -1.0]))
        for p in TWISTED
    ]
    seen, image = (
        observe(SMALL, follow(SMALL, NEO_HOOKEAN, path, EXACT)[-1]) for path in (TWISTED, mirrored)
    )
    np.testing.assert_allclose(image.wrench, seen.wrench * [1, -1, 1, -1, 1, -1], atol=1e-11)
    rows = seen.fiducials.reshape(4, 4, 3)[:, ::-1].reshape(16, 3)
    np.testing.assert_allclose(image.fiducials, rows * [1, -1, 1], atol=1e-12)


def test_fiducials_on_gripped_tissue_move_rigidly_with_the_gripper() -> None:
    state = twisted_state(NEO_HOOKEAN)
    held = SMALL.fiducials_gripped
    assert held.sum() == 2
    arms = REFERENCE_BLOCK.fiducials_rest[held] - np.array(REFERENCE_BLOCK.grasp.centre)
    expected = state.pose.position + state.pose.rotation.apply(arms)
    np.testing.assert_allclose(observe(SMALL, state).fiducials[held], expected, atol=1e-15)
