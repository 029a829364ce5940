"""Experiments in which a load is given and the gripper goes where it is carried, as under hung weights."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from retraction_cases import SMALL_BLOCK, block_at_rest, with_rows
from scipy.spatial.transform import Rotation

from estimator.experiment import Box, Environment, Experiment, SensorNoise
from estimator.experiment.model import Weight
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fit.estimate import estimate
from estimator.forward.meshing import mesh_experiment
from estimator.materials import NeoHookean
from estimator.materials.material import Material
from estimator.simulation.simulate import Resolution, simulate_case

FloatArray = NDArray[np.float64]

TINY = Grading(grasp_m=6e-3, anchor_m=10e-3, largest_m=20e-3, growth=3.0, layers=1)
EXACT = SensorNoise(1e-9, 1e-9, 1e-9, 1e-9, orientation_std=1e-9)


def carrying(rest: Experiment, forces: FloatArray, sensor: SensorNoise) -> Experiment:
    """The rest with one row a force (n, 3), N, of the tissue on the gripper; what else is of the load is empty."""
    rows = len(forces)
    stay = [GripperPose(np.array(rest.grasp.centre), Rotation.identity())] * rows
    load = np.full((rows, 6), np.nan)
    load[:, :3] = forces
    planned = with_rows(rest, stay, load, np.zeros((rows, *rest.fiducials_rest.shape)))
    return replace(planned, driven="load", sensor=sensor, first_row="under_load")


@pytest.mark.parametrize("weight", ["left_out", "acts"])
def test_a_column_stretches_under_a_hung_weight_and_its_own_as_the_closed_form_says(weight: Weight) -> None:
    """At ν = 0 its sides stay, and P = μ(λ − 1/λ) falls from the top by the specific weight."""
    length, tissue = 0.04, Material(NeoHookean(), 2e3, 0.0)
    upright = block_at_rest(
        (0.01, 0.01, length),
        Box((-0.005, -0.005, -length / 2), (0.005, 0.005, -length / 2)),
        EXACT,
        np.array([[0.0, 0.0, 0.0]]),
    )
    top = Box((-0.005, -0.005, length / 2), (0.005, 0.005, length / 2))
    hung = replace(upright, anchors=(top,), environment=Environment((0.0, 0.0, -9.81), "none", weight))
    force = 0.05
    planned = carrying(hung, np.array([[0.0, 0.0, force], [0.0, 0.0, 2 * force]]), EXACT)
    fine = Resolution(Grading(2.5e-3, 2.5e-3, 5e-3, 1.5, 1), "hex27")
    (seen,) = simulate_case([planned], tissue, 0, resolution=fine)
    below = np.linspace(0.0, 1.0, 20001)
    own = 1070 * 9.81 * length * below if weight == "acts" else 0.0 * below
    for row, pulled in enumerate((force, 2 * force)):
        stress = (pulled / 1e-4 + own) / tissue.lame[0]
        stretched = length * float(np.trapezoid((stress + np.sqrt(stress**2 + 4.0)) / 2.0, below))
        assert length / 2 - seen.position[row, 2] == pytest.approx(stretched, rel=1e-5)
        np.testing.assert_allclose(seen.wrench[row], [0.0, 0.0, pulled, 0.0, 0.0, 0.0], atol=1e-6)


def mesh(experiment: Experiment) -> RetractionProblem:
    return mesh_experiment(experiment, TINY)


@pytest.fixture(scope="module")
def hung() -> Experiment:
    """A clamped beam under its weight and three others at its end, its pose seen by markers."""
    tissue = Material(NeoHookean(), 60e3, 0.45)
    sensor = SensorNoise(2e-3, 2e-5, 5e-5, 1e-4, orientation_std=5e-3)
    clamped = replace(SMALL_BLOCK, environment=Environment((0.0, 0.0, -9.81), "none", "acts"))
    forces = np.outer(np.repeat([0.0, 0.02, 0.05, 0.08], 3), [0.0, 0.0, 1.0])
    (seen,) = simulate_case(
        [carrying(clamped, forces, sensor)], tissue, 3, resolution=Resolution(TINY, "hex27")
    )
    felt = np.full_like(seen.wrench, np.nan)
    felt[:, :3] = forces
    return replace(seen, wrench=felt, fiducials=np.full_like(seen.fiducials, np.nan))


def test_a_known_load_and_measured_poses_give_the_modulus(hung: Experiment) -> None:
    found = estimate([hung], mesh=mesh, finer_mesh=mesh)
    low, high = found.parameters["youngs_modulus"].interval95
    assert low < 60e3 < high
    assert high / low < 1.25
    assert found.noise_ratio < 1.5


def test_poses_that_were_only_measured_mislead_where_they_are_taken_for_exact(hung: Experiment) -> None:
    """A beam's force is a small difference of what deflection and rotation do."""
    torque = np.nan_to_num(hung.wrench, nan=0.0)
    exact = replace(hung.sensor, orientation_std=0.0, position_std=1e-5)
    driven = replace(hung, driven="pose", wrench=torque, sensor=replace(exact, force_zero="no_load"))
    assert estimate([driven], mesh=mesh, finer_mesh=mesh).noise_ratio > 3.0
