"""A sheet that stays flat: plane stress against an independent solution, and no wrinkles."""

from dataclasses import replace
from pathlib import Path

import felupe
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from retraction_cases import block_at_rest, follow, with_rows
from scipy.spatial.transform import Rotation

from estimator.experiment import (
    Box,
    Experiment,
    Grasp,
    Roller,
    SensorNoise,
    read_experiment,
    write_experiment,
)
from estimator.experiment.support import stays_flat, supposed_flat
from estimator.experiment_checks import findings_of
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.equilibrium.observation import observe
from estimator.fit.estimate import estimate
from estimator.forward.meshing import mesh_experiment
from estimator.materials import NeoHookean
from estimator.materials.material import Material
from estimator.report.estimation.findings import caveats
from estimator.simulation.simulate import Resolution, simulate_case

FloatArray = NDArray[np.float64]

SENSOR = SensorNoise(force_std=1e-3, torque_std=1e-3, fiducial_std=2e-5, position_std=2e-5)
EVEN = Grading(grasp_m=4e-3, anchor_m=4e-3, largest_m=4e-3, growth=1.0, layers=1)
LENGTH, WIDTH = 0.04, 0.024


def sheet(thickness: float, beads: FloatArray) -> Experiment:
    """Drawn between two edges that keep it from narrowing, and let it grow thinner."""
    x, y, z = LENGTH / 2, WIDTH / 2, thickness / 2
    left, right = Box((-x, -y, -z), (-x, y, z)), Box((x, -y, -z), (x, y, z))
    rest = block_at_rest((LENGTH, WIDTH, thickness), right, SENSOR, beads)
    return replace(
        rest,
        phantom=replace(rest.phantom, stays_flat=True),
        anchors=(),
        rollers=(Roller(left, ("x", "y")),),
        grasp=Grasp(right, (x, 0.0, 0.0), ("x", "y")),
    )


def plane_stress(way: FloatArray, poisson_ratio: float, beads: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Force on the edge that moves by ``way`` (2,), per thickness and modulus, and the beads' motion, by FElupe."""
    mesh = felupe.Rectangle(a=(-LENGTH / 2, -WIDTH / 2), b=(LENGTH / 2, WIDTH / 2), n=(81, 49))
    field = felupe.FieldContainer([felupe.Field(felupe.RegionQuad(mesh), dim=2)])
    held, moved = (np.isclose(mesh.points[:, 0], side * LENGTH / 2) for side in (-1, 1))
    boundaries = {"held": felupe.Boundary(field[0], mask=held)}
    for axis in range(2):
        skip = (axis == 1, axis == 0)
        boundaries[f"moved {axis}"] = felupe.Boundary(field[0], mask=moved, skip=skip, value=way[axis])
    body = felupe.SolidBody(felupe.LinearElasticPlaneStress(E=1.0, nu=poisson_ratio), field)
    step = felupe.Step(items=[body], boundaries=boundaries)
    felupe.Job(steps=[step]).evaluate(verbose=False)
    forces = body.assemble.vector(field).toarray().reshape(-1, 2)
    nodes = [int(np.argmin(np.linalg.norm(mesh.points - bead, axis=1))) for bead in beads]
    return forces[moved].sum(axis=0), field[0].values[nodes]


@pytest.mark.parametrize("poisson_ratio", [0.2, 0.45, 0.49])
def test_a_sheet_that_stays_flat_is_in_plane_stress(poisson_ratio: float) -> None:
    thickness, way = 0.5e-3, 2e-5 * np.array([1.0, 0.5])
    places = np.array([[0.0, 0.0], [0.01, 0.012], [-0.012, -0.008]])
    planned = sheet(thickness, np.column_stack([places, np.full(3, thickness / 2)]))
    problem = mesh_experiment(planned, EVEN)
    pose = GripperPose(np.array([LENGTH / 2 + way[0], way[1], 0.0]), Rotation.identity())
    (state,) = follow(problem, Material(NeoHookean(), 30e3, poisson_ratio), [pose])
    seen = observe(problem, state)
    force, moved = plane_stress(way, poisson_ratio, places)
    np.testing.assert_allclose(-seen.wrench[:2] / (30e3 * thickness), force, rtol=5e-3)
    motion = seen.fiducials - planned.fiducials_rest
    np.testing.assert_allclose(motion[:, :2], moved, atol=2e-3 * np.linalg.norm(way))


def gripped_by_pads(size: tuple[float, float, float], *, stays_flat: bool | None) -> Experiment:
    """Held by two pads in its midst, which are drawn apart: behind them it is compressed."""
    pad, half = 0.08 * size[0], size[2] / 2
    place = 0.2 * size[0]
    grasp = Box((-place - pad / 2, -pad / 2, -half), (-place + pad / 2, pad / 2, half))
    rest = block_at_rest(size, grasp, SENSOR, np.zeros((0, 3)))
    anchor = Box((place - pad / 2, -pad / 2, -half), (place + pad / 2, pad / 2, half))
    return replace(rest, anchors=(anchor,), phantom=replace(rest.phantom, stays_flat=stays_flat))


def turned_over(experiment: Experiment, thin: int) -> Experiment:
    """The same with its axes exchanged in turn, so that the one numbered ``thin`` is what z was."""
    places = [(axis - thin - 1) % 3 for axis in range(3)]

    def of(vector: tuple[float, float, float]) -> tuple[float, float, float]:
        return vector[places[0]], vector[places[1]], vector[places[2]]

    def boxed(box: Box) -> Box:
        return Box(of(box.lower), of(box.upper))

    return replace(
        experiment,
        phantom=replace(experiment.phantom, size_m=of(experiment.phantom.size_m)),
        anchors=tuple(boxed(anchor) for anchor in experiment.anchors),
        grasp=Grasp(boxed(experiment.grasp.box), of(experiment.grasp.centre)),
    )


def standing(rest: Experiment) -> Experiment:
    """Two rows in which nothing moves and nothing is felt."""
    pose = GripperPose(np.array(rest.grasp.centre), Rotation.identity())
    return with_rows(rest, [pose] * 2, np.zeros((2, 6)), np.zeros((2, *rest.fiducials_rest.shape)))


COARSE = Grading(grasp_m=4e-3, anchor_m=4e-3, largest_m=20e-3, growth=2.5, layers=1)


@settings(max_examples=6, deadline=None)
@given(
    thinness=st.floats(15.0, 200.0),
    drawn=st.floats(0.005, 0.05),
    poisson_ratio=st.floats(0.1, 0.48),
    thin=st.integers(0, 2),
)
def test_a_sheet_that_stays_flat_does_not_wrinkle_and_scales_with_its_thickness(
    thinness: float, drawn: float, poisson_ratio: float, thin: int
) -> None:
    """Whatever its plane, it is stable, its middle stays, and the force goes with the thickness."""
    felt = []
    for thickness in (0.05 / thinness, 0.025 / thinness):
        planned = turned_over(gripped_by_pads((0.1, 0.05, thickness), stays_flat=True), thin)
        problem = mesh_experiment(planned, COARSE)
        centre, along = np.array(planned.grasp.centre), np.eye(3)[(thin + 1) % 3]
        poses = [
            GripperPose(centre - share * drawn * 0.1 * along, Rotation.identity()) for share in (0.5, 1.0)
        ]
        state = follow(problem, Material(NeoHookean(), 8e3, poisson_ratio), poses)[-1]
        assert state.tangent.positive_definite
        middle = np.abs(problem.body.mesh.points[:, thin]) < 1e-9
        assert np.abs(state.displacement[middle, thin]).max() == 0.0
        felt.append(observe(problem, state).wrench[(thin + 1) % 3] / thickness)
    assert felt[0] == pytest.approx(felt[1], rel=0.05)


THIN = (0.1, 0.05, 0.0015)


def test_a_loose_thin_sheet_is_pointed_out_and_one_that_stays_flat_is_not() -> None:
    def said(experiment: Experiment) -> list[str]:
        return [finding.do for finding in findings_of(standing(experiment)) if finding.check == "sheet"]

    assert "stays_flat = true" in said(gripped_by_pads(THIN, stays_flat=None))[0]
    assert "stays_flat = true" in said(gripped_by_pads(THIN, stays_flat=False))[0]
    assert not said(gripped_by_pads(THIN, stays_flat=True))
    assert not said(gripped_by_pads((0.1, 0.05, 0.004), stays_flat=None))


@pytest.mark.parametrize("height", [0.0, 0.001, 0.002])
def test_a_thin_sheet_is_supposed_to_stay_flat_unless_it_was_seen_to_leave_its_plane(height: float) -> None:
    bead = np.array([[0.0, 0.0, THIN[2] / 2]])
    rest = replace(gripped_by_pads(THIN, stays_flat=None), fiducials_rest=bead, fiducials=bead[None])
    rows = standing(rest)
    seen = replace(rows, fiducials=bead + np.array([0.0, height])[:, None, None] * np.eye(3)[2])
    flat = height < THIN[2]
    assert stays_flat(seen) == flat
    assert bool(supposed_flat(seen)) == flat
    assert (mesh_experiment(seen, COARSE).rolling is not None) == flat
    assert not stays_flat(replace(seen, phantom=replace(seen.phantom, stays_flat=False)))


def test_a_loose_sheet_is_estimated_with_the_word_that_it_is_supposed_to_stay_flat() -> None:
    tissue, rest = Material(NeoHookean(), 8e3, 0.4), gripped_by_pads(THIN, stays_flat=None)
    beads = 1e-3 * np.array([(x, y, 0.75) for x in (-10.0, 0.0, 10.0) for y in (-6.0, 5.0)])
    rest = replace(rest, fiducials_rest=beads, fiducials=beads[None])
    ways = np.repeat([0.0, -5e-4, -1e-3, -2e-3], 3)
    poses = [
        GripperPose(np.array(rest.grasp.centre) + way * np.eye(3)[0], Rotation.identity()) for way in ways
    ]
    planned = with_rows(rest, poses, np.zeros((12, 6)), np.zeros((12, 6, 3)) + beads)
    (seen,) = simulate_case([planned], tissue, 5, resolution=Resolution(COARSE, "hex27"))
    found = estimate(
        [seen], mesh=lambda e: mesh_experiment(e, COARSE), finer_mesh=lambda e: mesh_experiment(e, COARSE)
    )
    low, high = found.parameters["youngs_modulus"].interval95
    assert low < tissue.youngs_modulus < high
    assert "is taken to stay in its plane" in caveats(found)[0]


def test_it_is_written_and_read(tmp_path: Path) -> None:
    planned = gripped_by_pads((0.1, 0.05, 0.0015), stays_flat=True)
    write_experiment(standing(planned), tmp_path / "sheet")
    assert read_experiment(tmp_path / "sheet").phantom.stays_flat
