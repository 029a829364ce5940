"""Forms beyond the plain ones: uneven thickness, single edges of a grasp, a curved modulus, a soft bed, shrinking."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from retraction_cases import REFERENCE_BLOCK, SMALL_BLOCK, straight_pull, with_rows
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

from estimator.effects.effect import Effect, Readings, Values
from estimator.effects.mounting.grasp_misplacement import GRASP_MISPLACEMENT
from estimator.effects.mounting.gravity_sag import GRAVITY_SAG
from estimator.effects.tissue.modulus_gradient import MODULUS_GRADIENT
from estimator.effects.tissue.prestretch import PRESTRETCH
from estimator.effects.tissue.thickness_error import THICKNESS_ERROR
from estimator.experiment import Experiment
from estimator.fem.assembly.body import build_body
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.discretisation.quadrature import quadrature_points
from estimator.fem.equilibrium.newton import EquilibriumSolver, NewtonSettings
from estimator.fem.equilibrium.observation import Observation, observe
from estimator.fem.equilibrium.state import EquilibriumState
from estimator.forward.meshing import mesh_experiment
from estimator.materials import NeoHookean
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

TINY = Grading(grasp_m=3e-3, anchor_m=8e-3, largest_m=25e-3, growth=3, layers=1)
BLOCK = mesh_experiment(REFERENCE_BLOCK, TINY)
# Gripped over its whole end face: a bar, free from x = −30 to 18 mm.
BAR = mesh_experiment(SMALL_BLOCK, TINY)
STIFFNESS_PA, AREA_M2 = 15e3, 0.03 * 0.01
TISSUE = Material(NeoHookean(), STIFFNESS_PA, 0.45)
SLENDER = Material(NeoHookean(), STIFFNESS_PA, 0.0)
SPECIFIC_WEIGHT = 1070 * 9.81


def form(effects: Sequence[Effect], name: str) -> Effect:
    return next(one for one in effects if one.form == name)


UNEVEN = form(THICKNESS_ERROR, "uneven")
EDGES = form(GRASP_MISPLACEMENT, "edges")
CURVED = form(MODULUS_GRADIENT, "curved_in_plane")
ON_BED, ON_BED_LYING = (form(GRAVITY_SAG, name) for name in ("on_soft_bed", "on_soft_bed_beads_lying"))
SHRUNK = form(PRESTRETCH, "shrunk_in_place")


def given(effect: Effect, **values: float) -> dict[str, float]:
    """The values; amplitudes that are not among them are zero."""
    return {**{amplitude.name: 0.0 for amplitude in effect.amplitudes}, **values}


def log_modulus(effect: Effect, values: Values) -> FloatArray:
    found = effect.log_modulus(BLOCK, given(effect, **values))
    assert found is not None
    return found


def changed(effect: Effect, values: Values, problem: RetractionProblem) -> RetractionProblem:
    moved = effect.problem(problem, values)
    logarithm = effect.log_modulus(moved, values)
    if logarithm is None:
        return moved
    return replace(moved, body=build_body(moved.body.mesh, np.exp(logarithm)))


def solved(
    effect: Effect,
    values: Values,
    pose: GripperPose,
    problem: RetractionProblem = BLOCK,
    material: Material = TISSUE,
    experiment: Experiment = REFERENCE_BLOCK,
) -> tuple[RetractionProblem, EquilibriumState, Observation]:
    """The problem under an effect, its state at a pose, and what is seen of it."""
    acted_on = changed(effect, values, problem)
    terms = effect.terms(acted_on, material, experiment, values)
    solver = EquilibriumSolver(acted_on, NewtonSettings(iterations=80))
    state = solver.solve(pose, material, solver.rest(material), terms)
    return acted_on, state, observe(acted_on, state)


def pull_of_bar(effect: Effect, length_m: float, **values: float) -> float:
    """The force with which a bar of no lateral contraction, drawn by a length, resists, N."""
    pose = GripperPose(BAR.grasp_centre + np.array([length_m, 0.0, 0.0]), Rotation.identity())
    _, _, seen = solved(effect, given(effect, **values), pose, BAR, SLENDER, SMALL_BLOCK)
    return -float(seen.wrench[0])


def at_rest(problem: RetractionProblem) -> GripperPose:
    return GripperPose(problem.grasp_centre, Rotation.identity())


@pytest.mark.parametrize("excess", [0.2, -0.25])
def test_slices_of_a_wedge_give_one_after_the_other(excess: float) -> None:
    """E A u over the sum of dx / (1 + a ξ), ξ from −1 at the anchor to 1 at the jaws."""
    length = 0.024 / excess * (np.log(1 + excess) - np.log(1 - excess))
    expected = STIFFNESS_PA * AREA_M2 * 1e-6 / length
    assert pull_of_bar(UNEVEN, 1e-6, excess_at_x_edge=excess) == pytest.approx(expected, rel=2e-3)


def test_the_edges_are_as_thick_as_their_amplitudes_say_and_a_crown_leaves_them_alone() -> None:
    def thickness(x: float, y: float, **values: float) -> float:
        points = UNEVEN.problem(BLOCK, given(UNEVEN, **values)).body.mesh.points
        column = np.linalg.norm(points[:, :2] - [x, y], axis=1) < 1e-9
        return float(np.ptp(points[column, 2]))

    slopes = {"excess_at_x_edge": 0.1, "excess_at_y_edge": -0.2}
    corners = [(x, y) for x in (-0.05, 0.05) for y in (-0.05, 0.05)]
    for x, y in corners:
        excess = 0.1 * x / 0.05 - 0.2 * y / 0.05
        assert thickness(x, y, **slopes) == pytest.approx(0.01 * (1 + excess))
        assert thickness(x, y, **slopes, excess_in_middle=0.3) == pytest.approx(0.01 * (1 + excess))
    columns = np.unique(BLOCK.body.mesh.points[:, :2], axis=0)
    x, y = columns[np.argmin(np.linalg.norm(columns, axis=1))]
    crown = 0.3 * (1 - (x / 0.05) ** 2) * (1 - (y / 0.05) ** 2)
    assert crown > 0.2
    assert thickness(x, y, excess_in_middle=0.3) == pytest.approx(0.01 * (1 + crown))


def test_a_wedge_across_the_pull_turns_it_to_the_thicker_side() -> None:
    (pose,) = straight_pull(REFERENCE_BLOCK, 2e-3, 1)
    wrenches = [
        solved(UNEVEN, given(UNEVEN, excess_at_y_edge=size), pose)[2].wrench for size in (0.0, 0.2, -0.2)
    ]
    even, left, right = wrenches
    assert abs(even[5]) < 1e-9
    # Tissue on the side of +y pulls back harder: it turns the gripper to +z.
    assert left[5] > 1e-4
    assert left[5] == pytest.approx(-right[5], rel=1e-6)
    assert left[0] == pytest.approx(right[0], rel=1e-6)


def test_beads_stay_where_they_were_measured_on_a_wedge_and_sit_on_its_face() -> None:
    moved = UNEVEN.problem(BLOCK, given(UNEVEN, excess_at_x_edge=0.2))
    np.testing.assert_array_equal(moved.fiducials_rest, REFERENCE_BLOCK.fiducials_rest)
    height = 0.2 * REFERENCE_BLOCK.fiducials_rest[:, 0] / 0.05 * 0.005
    np.testing.assert_allclose(moved.fiducials_off[:, 2], height, atol=1e-12)


@pytest.mark.parametrize(
    ("plain", "values", "edges"),
    [
        ("jaws", {"shift_x": -2e-3, "shift_y": 1e-3}, (2e-3, -2e-3, -1e-3, 1e-3)),
        ("extent", {"wider_x": 1e-3, "wider_y": -2e-3}, (1e-3, 1e-3, -2e-3, -2e-3)),
    ],
)
def test_edges_that_go_together_shift_the_grasp_or_widen_it(
    plain: str, values: Values, edges: tuple[float, ...]
) -> None:
    own = dict(zip((one.name for one in EDGES.amplitudes), edges, strict=True))
    assert list(own) == ["edge_x_lower", "edge_x_upper", "edge_y_lower", "edge_y_upper"]
    found, expected = (
        effect.problem(BLOCK, each).body.mesh.points
        for effect, each in ((EDGES, own), (form(GRASP_MISPLACEMENT, plain), values))
    )
    np.testing.assert_allclose(found, expected, atol=1e-15)


@pytest.mark.parametrize(
    ("name", "axis", "side", "outward"),
    [("edge_x_lower", 0, 0.03, -1), ("edge_y_lower", 1, -0.01, -1), ("edge_y_upper", 1, 0.01, 1)],
)
def test_one_edge_lies_farther_out_and_the_others_where_they_are_stated(
    name: str, axis: int, side: float, outward: int
) -> None:
    before = BLOCK.body.mesh.points
    after = EDGES.problem(BLOCK, given(EDGES, **{name: 2e-3})).body.mesh.points
    moved = (after - before)[BLOCK.gripped]
    at_edge = np.isclose(before[BLOCK.gripped, axis], side)
    np.testing.assert_allclose(moved[at_edge, axis], 2e-3 * outward, atol=1e-12)
    for other, away in ((0, 0.03), (0, 0.05), (1, -0.01), (1, 0.01)):
        if (other, away) != (axis, side):
            there = np.isclose(before[BLOCK.gripped, other], away)
            np.testing.assert_allclose(moved[there, other], 0.0, atol=1e-12)


def test_a_curved_modulus_is_as_stated_in_the_centre_and_quadratic_from_there() -> None:
    x, y, _ = np.moveaxis(quadrature_points(BLOCK.body.mesh), -1, 0)
    sizes = {"log_modulus_by_y": 2.0, "log_modulus_curvature_x": 200.0, "log_modulus_curvature_y": -100.0}
    found = log_modulus(CURVED, sizes)
    np.testing.assert_allclose(found, 2.0 * y + 100.0 * x**2 - 50.0 * y**2, atol=1e-14)


def test_a_curved_modulus_without_curvature_is_a_gradient() -> None:
    slopes = {"log_modulus_by_x": 2.0, "log_modulus_by_y": -1.0}
    np.testing.assert_allclose(
        log_modulus(CURVED, slopes),
        log_modulus(form(MODULUS_GRADIENT, "in_plane"), slopes),
        atol=1e-15,
    )


@pytest.mark.parametrize("curvature", [800.0, -800.0])
def test_slices_of_a_curved_modulus_give_one_after_the_other(curvature: float) -> None:
    length, _ = quad(lambda x: np.exp(-0.5 * curvature * x**2), -0.03, 0.018)
    expected = STIFFNESS_PA * AREA_M2 * 1e-6 / length
    assert abs(length / 0.048 - 1) > 0.05
    found = pull_of_bar(CURVED, 1e-6, log_modulus_curvature_x=curvature)
    assert found == pytest.approx(expected, rel=2e-3)


def test_far_from_its_holds_a_sheet_sinks_into_a_soft_bed_by_its_weight_over_the_beds_stiffness() -> None:
    bed = {"weight": 1.0, "bed_stiffness": 1e7}
    problem, state, _ = solved(ON_BED, bed, at_rest(BLOCK))
    points = problem.body.mesh.points
    far = (
        (points[:, 0] > -0.02)
        & (points[:, 0] < 0.0)
        & (np.abs(points[:, 1]) < 0.03)
        & (points[:, 2] < -0.0049)
    )
    assert far.any()
    sunk = SPECIFIC_WEIGHT * 0.01 / 1e7
    np.testing.assert_allclose(state.displacement[far, 2], -sunk, rtol=0.05)


def test_what_the_bed_does_not_carry_hangs_on_gripper_and_anchors() -> None:
    values = {"weight": 1.0, "bed_stiffness": 2e4}
    problem, state, _ = solved(ON_BED, values, at_rest(BLOCK))
    weight, bed = (
        term.forces(state.displacement, state.response).sum(axis=0)
        for term in ON_BED.terms(problem, TISSUE, REFERENCE_BLOCK, values)
    )
    all_of_it = SPECIFIC_WEIGHT * (1e-4 - 0.02 * 0.02 * 0.01)
    np.testing.assert_allclose(weight, [0.0, 0.0, all_of_it], atol=1e-12)
    assert 0.3 * all_of_it < -bed[2] < 0.95 * all_of_it
    np.testing.assert_allclose(state.forces.sum(axis=0), weight + bed, atol=1e-9)


def test_a_bed_pushes_and_never_pulls() -> None:
    _, bed = ON_BED.terms(BLOCK, TISSUE, REFERENCE_BLOCK, {"weight": 1.0, "bed_stiffness": 1e5})
    _, state, _ = solved(ON_BED, given(ON_BED, bed_stiffness=1e5), at_rest(BLOCK))
    up = np.tile([0.0, 0.0, 1e-3], (len(BLOCK.body.mesh.points), 1))
    assert not bed.forces(up, state.response).any()
    # It joins the internal forces: against what sinks by 1 mm push 100 Pa.
    pushed = bed.forces(-up, state.response).sum(axis=0)
    np.testing.assert_allclose(pushed, [0.0, 0.0, -100.0 * (0.01 - 0.02 * 0.02)], atol=1e-9)


def test_on_a_bed_that_hardly_pushes_a_phantom_hangs() -> None:
    hangs = solved(form(GRAVITY_SAG, "beads_undeformed"), {"weight": 0.5}, at_rest(BLOCK))[1]
    lies = solved(ON_BED, {"weight": 0.5, "bed_stiffness": 1.0}, at_rest(BLOCK))[1]
    assert np.abs(hangs.displacement).max() > 2e-3
    np.testing.assert_allclose(lies.displacement, hangs.displacement, atol=2e-6)


def test_a_known_weight_leaves_nothing_to_a_bed() -> None:
    heavy = replace(BLOCK, specific_weight=np.array([0.0, 0.0, -SPECIFIC_WEIGHT]))
    assert ON_BED.terms(heavy, TISSUE, REFERENCE_BLOCK, {"weight": 1.0, "bed_stiffness": 1e5}) == ()


@pytest.mark.parametrize(
    ("effect", "values", "moved_m"),
    [(ON_BED_LYING, {"weight": 1.0, "bed_stiffness": 3e4}, 1e-3), (SHRUNK, {"shrunk": 0.02}, 4e-4)],
    ids=["bed", "shrunk"],
)
def test_beads_that_were_seen_once_mounted_sit_on_tissue_that_came_there(
    effect: Effect, values: Values, moved_m: float
) -> None:
    _, state, _ = solved(effect, values, at_rest(BLOCK))
    seen = BLOCK.fiducial_positions(state.displacement, at_rest(BLOCK))
    stated = mesh_experiment(replace(REFERENCE_BLOCK, fiducials_rest=seen), TINY)
    placed = effect.beads(stated, state.displacement, values)
    moved = np.linalg.norm(seen - REFERENCE_BLOCK.fiducials_rest, axis=1).max()
    assert moved > moved_m
    np.testing.assert_allclose(placed.fiducials_rest, REFERENCE_BLOCK.fiducials_rest, atol=0.03 * moved)


@pytest.mark.parametrize("shrunk", [1e-4, -1e-4])
def test_a_bar_that_shrinks_between_its_ends_is_drawn_by_its_strain(shrunk: float) -> None:
    """E A s; where it swells it presses."""
    found = pull_of_bar(SHRUNK, 0.0, shrunk=shrunk)
    assert found == pytest.approx(STIFFNESS_PA * AREA_M2 * shrunk, rel=2e-3)


def test_the_sensors_zero_hides_what_shrinking_draws_with() -> None:
    poses = [at_rest(BLOCK), *straight_pull(REFERENCE_BLOCK, 5e-3, 1)]
    values = {"shrunk": 0.02}
    seen = [solved(SHRUNK, values, pose)[2] for pose in poses]
    wrench, beads = (np.array([getattr(one, name) for one in seen]) for name in ("wrench", "fiducials"))
    experiment = with_rows(REFERENCE_BLOCK, poses, np.zeros((2, 6)), np.zeros((2, 16, 3)))
    position = experiment.position
    rotation = Rotation.concatenate([pose.rotation for pose in poses])
    truth = Readings(experiment, position, rotation, position, wrench, beads, wrench[0], beads[0])
    assert wrench[0, 0] < -0.02
    read = SHRUNK.readings(truth, values)
    np.testing.assert_allclose(read.wrench[0], 0.0, atol=1e-12)
    np.testing.assert_allclose(read.fiducials[0], REFERENCE_BLOCK.fiducials_rest, atol=1e-12)
    np.testing.assert_allclose(read.wrench[1, :3], wrench[1, :3] - wrench[0, :3], atol=1e-12)
