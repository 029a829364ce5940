"""Measured displacements as a boundary: homogeneous states, and a region cut out of a body that was measured whole."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from retraction_cases import block_at_rest, follow, with_rows
from scipy.spatial.transform import Rotation

from estimator.errors import InputError
from estimator.experiment import (
    Box,
    Experiment,
    Prescribed,
    SensorNoise,
    check_same_mounting,
    read_experiment,
    write_experiment,
)
from estimator.experiment.holds import AXES
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.equilibrium.newton import NewtonSettings
from estimator.fem.equilibrium.observation import observe
from estimator.fit.estimate import estimate
from estimator.forward.meshing import mesh_experiment
from estimator.materials import NeoHookean
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

SIZE = np.array([0.03, 0.02, 0.01])
SENSOR = SensorNoise(force_std=2e-3, torque_std=2e-5, fiducial_std=2e-5, position_std=1e-6)
TINY = Grading(grasp_m=10e-3, anchor_m=10e-3, largest_m=20e-3, growth=3.0, layers=1)
TISSUE = Material(NeoHookean(), 20e3, 0.4)
FACE = Box((0.015, -0.01, -0.005), (0.015, 0.01, 0.005))


def faces() -> tuple[Box, ...]:
    found = []
    for axis in range(3):
        for side in (-1, 1):
            lower, upper = -SIZE / 2, SIZE / 2
            lower[axis] = upper[axis] = side * SIZE[axis] / 2
            (a, b, c), (d, e, f) = lower.tolist(), upper.tolist()
            found.append(Box((a, b, c), (d, e, f)))
    return tuple(found)


def lattice(counts: tuple[int, int, int], size: FloatArray) -> FloatArray:
    lines = [np.linspace(-edge / 2, edge / 2, count) for edge, count in zip(size, counts, strict=True)]
    return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)


def poses_along(centre: FloatArray, ways: FloatArray) -> list[GripperPose]:
    return [GripperPose(centre + way, Rotation.identity()) for way in ways]


def led_by(gradient: FloatArray, boxes: tuple[Box, ...]) -> Experiment:
    """A block whose beads move by a displacement gradient that grows in even steps; what is in ``boxes`` follows."""
    beads = lattice((4, 3, 3), SIZE)
    rest = block_at_rest((0.03, 0.02, 0.01), FACE, SENSOR, beads)
    shares = np.linspace(0.0, 1.0, 7)
    moved = np.array([beads + share * beads @ gradient.T for share in shares])
    centre = np.array(rest.grasp.centre)
    poses = poses_along(centre, np.outer(shares, gradient @ centre))
    rows = with_rows(rest, poses, np.zeros((len(poses), 6)), moved)
    return replace(rows, anchors=(), prescribed=tuple(Prescribed(box, AXES) for box in boxes))


@settings(max_examples=8, deadline=None)
@given(entries=st.lists(st.floats(-0.12, 0.12), min_size=9, max_size=9))
def test_a_boundary_that_moves_evenly_strains_the_tissue_evenly(entries: list[float]) -> None:
    """Whatever the gradient of the displacement, the force on the face is the nominal stress times its area."""
    gradient = np.array(entries).reshape(3, 3) + 0.03 * np.eye(3)
    planned = led_by(gradient, faces())
    problem = mesh_experiment(planned, TINY)
    pose = GripperPose(planned.position[-1], Rotation.identity())
    (state,) = follow(problem, TISSUE, [pose])
    seen = observe(problem, state)
    deformation = np.eye(3) + gradient
    mu, lame = TISSUE.lame
    volume, inverse = np.linalg.det(deformation), np.linalg.inv(deformation).T
    stress = mu * (deformation - inverse) + lame * (volume - 1.0) * volume * inverse
    force = -stress[:, 0] * SIZE[1] * SIZE[2]
    np.testing.assert_allclose(seen.wrench[:3], force, atol=1e-7 * 20e3 * SIZE[1] * SIZE[2])
    np.testing.assert_allclose(seen.fiducials, planned.fiducials[-1], atol=1e-9)


def test_what_is_felt_on_a_boundary_that_is_led_has_the_derivatives_of_solved_states() -> None:
    gradient = np.array([[0.08, 0.05, 0.0], [0.02, -0.04, 0.03], [0.05, 0.0, -0.02]])
    ends = tuple(Box((x, -0.01, -0.005), (x, 0.01, 0.005)) for x in (-0.015, 0.015))
    planned = led_by(gradient, ends)
    problem = mesh_experiment(planned, TINY)
    there = planned.position[-1]
    along = (there - planned.position[0]) / np.linalg.norm(there - planned.position[0])

    def seen(step: float) -> FloatArray:
        pose = GripperPose(there + step * along, Rotation.identity())
        (state,) = follow(problem, TISSUE, [pose], NewtonSettings(tolerance=1e-13))
        observed = observe(problem, state)
        return np.concatenate([observed.wrench, observed.fiducials.ravel()])

    (state,) = follow(problem, TISSUE, [GripperPose(there, Rotation.identity())])
    observed = observe(problem, state)
    exact = (
        np.concatenate([observed.wrench_by_pose, observed.fiducials_by_pose.reshape(-1, 6)])[:, :3] @ along
    )
    quotient = (seen(1e-5) - seen(-1e-5)) / 2e-5
    for kind in (slice(0, 3), slice(3, 6), slice(6, None)):
        np.testing.assert_allclose(exact[kind], quotient[kind], atol=1e-5 * np.abs(quotient[kind]).max())


def cut_out(noise: float) -> Experiment:
    """The middle of a block that is pulled aside by a part of its end: a region whose ends bend as was seen there."""
    size = (0.06, 0.02, 0.01)
    whole = block_at_rest(size, Box((0.024, 0.0, -0.005), (0.03, 0.01, 0.005)), SENSOR, np.zeros((0, 3)))
    region = np.array([0.024, 0.02, 0.01])
    beads = lattice((9, 6, 3), region)
    whole = replace(whole, fiducials_rest=beads, fiducials=beads[None])
    problem = mesh_experiment(whole, Grading(3e-3, 6e-3, 6e-3, 1.5, 1))
    poses = poses_along(np.array(whole.grasp.centre), np.outer(np.linspace(0.0, 1.0, 8), [3e-3, 1e-3, 0.0]))
    seen = [observe(problem, state) for state in follow(problem, TISSUE, poses)]
    random = np.random.default_rng(4)
    wrench = np.full((len(seen), 6), np.nan)
    wrench[:, :3] = [one.wrench[:3] for one in seen]
    wrench[:, :3] += noise * SENSOR.force_std * random.normal(size=(len(seen), 3))
    points = np.array([one.fiducials for one in seen])
    points += noise * SENSOR.fiducial_std * random.normal(size=points.shape)
    face = Box((0.012, -0.01, -0.005), (0.012, 0.01, 0.005))
    part = block_at_rest((0.024, 0.02, 0.01), face, SENSOR, beads)
    # The gripper's way counts from where it was, not from the face that stands for it.
    centre = np.array(part.grasp.centre)
    moved = [GripperPose(centre + pose.position - poses[0].position, pose.rotation) for pose in poses]
    rows = with_rows(part, moved, wrench, points)
    ends = (Box((-0.012, -0.01, -0.005), (-0.012, 0.01, 0.005)), face)
    return replace(rows, anchors=(), prescribed=tuple(Prescribed(end, AXES, 5e-3) for end in ends))


def test_the_material_of_a_region_is_found_from_what_was_measured_around_it() -> None:
    mesh = Grading(3e-3, 3e-3, 5e-3, 1.5, 1)
    found = estimate(
        [cut_out(1.0)], mesh=lambda e: mesh_experiment(e, mesh), finer_mesh=lambda e: mesh_experiment(e, mesh)
    )
    low, high = found.parameters["youngs_modulus"].interval95
    assert low < TISSUE.youngs_modulus < high < 1.3 * low
    low, high = found.parameters["poisson_ratio"].interval95
    assert low < TISSUE.poisson_ratio < high


def test_it_is_written_and_read_and_is_of_one_experiment(tmp_path: Path) -> None:
    planned = led_by(0.05 * np.eye(3), faces())
    write_experiment(planned, tmp_path / "led")
    read = read_experiment(tmp_path / "led")
    assert read.prescribed == planned.prescribed
    with pytest.raises(InputError, match="take the experiments one by one"):
        check_same_mounting([read, read])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda e: replace(e, fiducials=np.full_like(e.fiducials, np.nan)), "has 0 beads in reach whose x"),
        (
            lambda e: replace(e, fiducials=e.fiducials + 2e-3 * (np.arange(7) % 2)[:, None, None]),
            "off the gripper's way",
        ),
        (lambda e: replace(e, position=e.position[:1].repeat(7, axis=0)), "takes a gripper that moves"),
    ],
)
def test_a_boundary_that_cannot_be_led_is_told_in_one_line(
    change: Callable[[Experiment], Experiment], said: str
) -> None:
    with pytest.raises(InputError, match=said):
        mesh_experiment(change(led_by(0.05 * np.eye(3), faces())), TINY)
