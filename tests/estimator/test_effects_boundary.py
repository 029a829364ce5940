"""Another rest shape: a misplaced grasp, a false thickness, tension at the mounting; and the nulls of them all."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from retraction_cases import REFERENCE_BLOCK, follow, straight_pull, turning_pull, with_rows
from scipy.spatial.transform import Rotation

from estimator.effects.effect import Effect, Motion, Readings, Values
from estimator.effects.mounting.anchor_compliance import ANCHOR_COMPLIANCE
from estimator.effects.mounting.anchor_debonding import ANCHOR_DEBONDING
from estimator.effects.mounting.grasp_misplacement import GRASP_MISPLACEMENT
from estimator.effects.mounting.gravity_sag import GRAVITY_SAG
from estimator.effects.mounting.support_friction import SUPPORT_FRICTION
from estimator.effects.tissue.prestretch import PRESTRETCH
from estimator.effects.tissue.thickness_error import THICKNESS_ERROR
from estimator.experiment import Box, Experiment, Grasp
from estimator.fem.boundary.anchorage import rim_of
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.equilibrium.observation import Observation, observe
from estimator.forward.meshing import mesh_experiment
from estimator.materials import NeoHookean
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

TINY = Grading(grasp_m=3e-3, anchor_m=8e-3, largest_m=25e-3, growth=3, layers=1)
BLOCK = mesh_experiment(REFERENCE_BLOCK, TINY)
MATERIAL = Material(NeoHookean(), 15e3, 0.45)
ALL: tuple[Effect, ...] = (
    *ANCHOR_COMPLIANCE,
    ANCHOR_DEBONDING,
    *GRASP_MISPLACEMENT,
    *THICKNESS_ERROR,
    *PRESTRETCH,
    *GRAVITY_SAG,
    *SUPPORT_FRICTION,
)
GRIPPER, JAWS, TURNED, EXTENT, ORIGIN, _ = GRASP_MISPLACEMENT
EVEN_THICKNESS = THICKNESS_ERROR[:3]


def observed(problem: RetractionProblem, poses: Sequence[GripperPose]) -> list[Observation]:
    return [observe(problem, state) for state in follow(problem, MATERIAL, poses)]


def pulled_from(centre: FloatArray) -> list[GripperPose]:
    """One centimetre along x, turning by 0.2 rad."""
    return [GripperPose(centre + np.array([0.01, 0.0, 0.0]), Rotation.from_rotvec([0.0, 0.0, 0.2]))]


def motion_of(poses: Sequence[GripperPose]) -> Motion:
    experiment = with_rows(REFERENCE_BLOCK, poses, np.zeros((len(poses), 6)), np.zeros((len(poses), 16, 3)))
    rotation = Rotation.concatenate([pose.rotation for pose in poses])
    nothing = np.zeros((len(poses), 6))
    return Motion(experiment, experiment.position, rotation, nothing, nothing, experiment.time)


def readings_of(poses: Sequence[GripperPose], seen: Sequence[Observation]) -> Readings:
    motion = motion_of(poses)
    wrench = np.array([one.wrench for one in seen])
    fiducials = np.array([one.fiducials for one in seen])
    return Readings(
        motion.experiment,
        motion.position,
        motion.rotation,
        motion.position,
        wrench,
        fiducials,
        wrench[0],
        fiducials[0],
    )


@pytest.mark.parametrize("effect", ALL, ids=lambda effect: effect.name)
def test_at_its_null_an_effect_returns_what_it_was_given(effect: Effect) -> None:
    values = {amplitude.name: 0.0 for amplitude in effect.amplitudes}
    values |= {constant.name: constant.grid[0] for constant in effect.constants}
    poses = pulled_from(BLOCK.grasp_centre)
    motion, readings = motion_of(poses), readings_of(poses, observed(BLOCK, poses))
    assert effect.problem(BLOCK, values) is BLOCK
    assert effect.terms(BLOCK, MATERIAL, REFERENCE_BLOCK, values) == ()
    assert effect.motion(motion, values) is motion
    assert effect.readings(readings, values) is readings
    assert effect.material(MATERIAL, values) is MATERIAL


@pytest.mark.parametrize("effect", ALL, ids=lambda effect: effect.name)
def test_an_effect_says_rightly_whether_it_frees_or_holds_nodes(effect: Effect) -> None:
    values = {amplitude.name: amplitude.scale for amplitude in effect.amplitudes}
    values |= {constant.name: constant.grid[0] for constant in effect.constants}
    changed = effect.problem(BLOCK, values)
    assert np.array_equal(changed.pattern.free, BLOCK.pattern.free) == effect.keeps_pattern
    assert np.array_equal(changed.gripped, BLOCK.gripped)
    assert np.array_equal(changed.body.mesh.cells, BLOCK.body.mesh.cells)


def test_names_are_unique_and_sizes_are_ordered() -> None:
    assert len({effect.name for effect in ALL}) == len(ALL)
    for effect in ALL:
        for amplitude in effect.amplitudes:
            assert 0.0 < amplitude.smallest < amplitude.scale < amplitude.upper
            assert amplitude.lower <= 0.0


def grasped_at(shift: Sequence[float]) -> Experiment:
    """The reference block, truly grasped elsewhere; what of the box lies beyond the block holds nothing."""
    grasp = REFERENCE_BLOCK.grasp
    lower, upper = (np.array(corner) + shift for corner in (grasp.box.lower, grasp.box.upper))
    upper[0] = min(upper[0], 0.05)
    centre = np.array(grasp.centre) + shift
    return replace(REFERENCE_BLOCK, grasp=Grasp(Box(tuple(lower), tuple(upper)), tuple(centre)))


@pytest.mark.parametrize("shift", [(0.006, 0.0007, 0.0), (0.002, -0.004, 0.0)])
def test_a_misplaced_grasp_answers_like_a_phantom_meshed_for_that_grasp(shift: tuple[float, ...]) -> None:
    grading = Grading(grasp_m=3e-3, anchor_m=8e-3, largest_m=15e-3, growth=2, layers=1)
    stated = mesh_experiment(REFERENCE_BLOCK, grading)
    values = {"shift_x": shift[0], "shift_y": shift[1]}
    moved = GRIPPER.problem(stated, values)
    poses = pulled_from(stated.grasp_centre)
    motion = GRIPPER.motion(motion_of(poses), values)
    np.testing.assert_allclose(motion.position - motion_of(poses).position, [shift])
    true_poses = pulled_from(moved.grasp_centre)
    np.testing.assert_allclose(motion.position[0], true_poses[0].position)
    (plain,), (seen,) = observed(stated, poses), observed(moved, true_poses)
    (expected,) = observed(mesh_experiment(grasped_at(shift), grading), true_poses)
    effect = np.abs(expected.wrench - plain.wrench)[:3].max()
    assert np.abs(seen.wrench - expected.wrench)[:3].max() < 0.05 * effect
    np.testing.assert_allclose(seen.fiducials, expected.fiducials, atol=1e-4)
    assert np.abs(expected.fiducials - plain.fiducials).max() > 1e-3


@pytest.mark.parametrize("wider", [(0.003, 0.002), (-0.002, 0.004), (-0.003, -0.003)])
def test_a_larger_or_smaller_grasp_answers_like_a_phantom_meshed_for_it(wider: tuple[float, float]) -> None:
    grading = Grading(grasp_m=3e-3, anchor_m=8e-3, largest_m=15e-3, growth=2, layers=1)
    stated = mesh_experiment(REFERENCE_BLOCK, grading)
    grasp, out = REFERENCE_BLOCK.grasp, np.array([*wider, 0.0])
    lower, upper = np.array(grasp.box.lower) - out, np.array(grasp.box.upper) + out
    upper[0] = 0.05  # the block ends there
    truly = replace(REFERENCE_BLOCK, grasp=Grasp(Box(tuple(lower), tuple(upper)), grasp.centre))
    poses = pulled_from(stated.grasp_centre)
    (plain,), (expected,) = observed(stated, poses), observed(mesh_experiment(truly, grading), poses)
    (seen,) = observed(EXTENT.problem(stated, dict(zip(("wider_x", "wider_y"), wider, strict=True))), poses)
    effect = np.abs(expected.wrench - plain.wrench)[:3].max()
    assert np.abs(seen.wrench - expected.wrench)[:3].max() < 0.05 * effect
    np.testing.assert_allclose(seen.fiducials, expected.fiducials, atol=1e-4)


def test_a_grasp_that_is_a_face_grows_along_the_face_alone() -> None:
    grading = Grading(grasp_m=3e-3, anchor_m=8e-3, largest_m=15e-3, growth=2, layers=1)

    def end_face(wider_y: float) -> RetractionProblem:
        (_, *low), (_, *high) = REFERENCE_BLOCK.grasp.box.lower, REFERENCE_BLOCK.grasp.box.upper
        box = Box((0.05, low[0] - wider_y, low[1]), (0.05, high[0] + wider_y, high[1]))
        grasp = Grasp(box, (0.05, *REFERENCE_BLOCK.grasp.centre[1:]))
        return mesh_experiment(replace(REFERENCE_BLOCK, grasp=grasp), grading)

    stated = end_face(0.0)
    poses = pulled_from(stated.grasp_centre)
    (plain,), (expected,) = observed(stated, poses), observed(end_face(0.002), poses)
    (seen,) = observed(EXTENT.problem(stated, {"wider_x": 0.003, "wider_y": 0.002}), poses)
    effect = np.abs(expected.wrench - plain.wrench)[:3].max()
    assert np.abs(seen.wrench - expected.wrench)[:3].max() < 0.05 * effect


@pytest.mark.parametrize("effect", GRASP_MISPLACEMENT, ids=lambda effect: effect.name)
def test_beads_rest_where_they_were_seen_when_the_mesh_is_moved(effect: Effect) -> None:
    values = {amplitude.name: 1.5 * amplitude.scale for amplitude in effect.amplitudes}
    moved = effect.problem(BLOCK, values)
    loose = ~moved.fiducials_gripped
    points = moved.body.mesh.points
    rest = np.einsum("mk,mkx->mx", moved.fiducial_weights, points[moved.fiducial_nodes])[loose]
    np.testing.assert_allclose(rest, REFERENCE_BLOCK.fiducials_rest[loose], atol=1e-9)
    assert np.array_equal(moved.fiducials_rest, REFERENCE_BLOCK.fiducials_rest)
    assert moved.body.volume.min() > 0.0
    outline = (np.abs(BLOCK.body.mesh.points[:, :2]) == 0.05).any(axis=1)
    np.testing.assert_allclose(np.abs(points[outline, :2]).max(axis=1), 0.05)
    assert np.array_equal(points[BLOCK.fixed], BLOCK.body.mesh.points[BLOCK.fixed])


@pytest.mark.parametrize("turn", [0.0, 0.2])
def test_an_origin_that_lies_elsewhere_on_the_jaws_moves_the_torques_alone_until_they_turn(
    turn: float,
) -> None:
    shift, turned = np.array([2e-3, -1e-3, 0.0]), Rotation.from_rotvec([0.0, 0.0, turn])
    values = {"shift_x": 2e-3, "shift_y": -1e-3}
    reported = [GripperPose(BLOCK.grasp_centre + np.array([0.01, 0.0, 0.0]), turned)]
    motion = ORIGIN.motion(motion_of(reported), values)
    true = [GripperPose(motion.position[0], turned)]
    # The jaws turn about the origin: its old place is carried along.
    as_if = [GripperPose(true[0].position - turned.apply(shift), turned)]
    (plain,), (seen,) = observed(BLOCK, as_if), observed(ORIGIN.problem(BLOCK, values), true)
    np.testing.assert_allclose(seen.wrench[:3], plain.wrench[:3], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(seen.fiducials, plain.fiducials, atol=1e-12)
    lever = np.cross(turned.apply(shift), plain.wrench[:3])
    np.testing.assert_allclose(plain.wrench[3:] - seen.wrench[3:], lever, atol=1e-9)
    assert np.allclose(as_if[0].position, reported[0].position) == (turn == 0.0)


def test_a_bead_that_the_shifted_jaws_reach_moves_with_them() -> None:
    beads = np.array([[0.028, 0.0, 0.005], [0.022, 0.0, 0.005]])
    stated = mesh_experiment(replace(REFERENCE_BLOCK, fiducials_rest=beads), TINY)
    assert not stated.fiducials_gripped.any()
    moved = JAWS.problem(stated, {"shift_x": -0.005, "shift_y": 0.0})
    assert moved.fiducials_gripped.tolist() == [True, False]


def test_the_jaws_turn_by_the_yaw() -> None:
    moved = TURNED.problem(BLOCK, {"yaw": 0.1})
    gripped = BLOCK.gripped & (BLOCK.body.mesh.points[:, 0] < 0.0301)
    before, after = BLOCK.body.mesh.points[gripped], moved.body.mesh.points[gripped]
    ends = np.argmin(before[:, 1]), np.argmax(before[:, 1])
    edge = after[ends[1]] - after[ends[0]]
    assert np.arctan2(-edge[0], edge[1]) == pytest.approx(0.1, abs=0.01)


@pytest.mark.parametrize("yaw", [0.1, -0.27])
def test_the_sides_of_turned_jaws_are_as_far_apart_as_ever_up_to_the_phantoms_border(yaw: float) -> None:
    moved = TURNED.problem(BLOCK, {"yaw": yaw})
    before = BLOCK.body.mesh.points[BLOCK.gripped] - BLOCK.grasp_centre
    after = moved.body.mesh.points[BLOCK.gripped] - BLOCK.grasp_centre
    across = np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    sides = np.isclose(np.abs(before[:, 1]), 0.01)
    np.testing.assert_allclose(after[sides] @ across, before[sides, 1], atol=1e-12)
    at_border = np.isclose(before[:, 0], 0.01)
    assert (sides & at_border).any()
    np.testing.assert_allclose(after[at_border, 0], 0.01)


def test_a_stretched_force_follows_the_thickness() -> None:
    """In plane a sheet of twice the thickness is two sheets."""
    pull = straight_pull(REFERENCE_BLOCK, 1e-4, 1)
    plain = observed(BLOCK, pull)[0].wrench[0]
    for effect in EVEN_THICKNESS:
        thicker = observed(effect.problem(BLOCK, {"excess": 0.1}), pull)[0].wrench[0]
        assert thicker / plain == pytest.approx(1.1, abs=0.01)


def test_beads_on_a_thicker_phantom_lie_where_they_were_measured_or_on_its_face() -> None:
    heights = [effect.problem(BLOCK, {"excess": 0.2}).fiducials_rest[0, 2] for effect in EVEN_THICKNESS]
    np.testing.assert_allclose(heights, [0.005, 0.006, 0.007])


def test_a_gripped_bead_turns_with_the_tissue_that_it_sits_on() -> None:
    """Of a phantom thinner than stated that lies nearer to the middle: a turn about x carries it aside by less."""
    centre = np.array(REFERENCE_BLOCK.grasp.centre)
    pose = GripperPose(centre, Rotation.from_rotvec([np.pi / 2, 0.0, 0.0]))
    bead = int(np.flatnonzero(BLOCK.fiducials_gripped)[0])
    at_rest = BLOCK.fiducials_rest[bead]
    asides = []
    for effect in EVEN_THICKNESS[:2]:
        thinner = effect.problem(BLOCK, {"excess": -0.2})
        moved = thinner.fiducial_positions(np.zeros_like(thinner.body.mesh.points), pose)[bead]
        asides.append(moved[1] - at_rest[1])
    np.testing.assert_allclose(asides, -at_rest[1] - 0.8 * at_rest[2])


def mounted(effect: Effect, values: Values, poses: Sequence[GripperPose]) -> tuple[Readings, Readings]:
    """What is there, and what the sensors read of it."""
    truth = readings_of(poses, observed(effect.problem(BLOCK, values), poses))
    return truth, effect.readings(truth, values)


def test_a_prestretched_phantom_pulls_at_rest_and_the_zero_hides_it() -> None:
    centre = np.array(REFERENCE_BLOCK.grasp.centre)
    poses = [GripperPose(centre, Rotation.identity()), *turning_pull(REFERENCE_BLOCK, 0.01, np.zeros(3), 2)]
    plain = observed(BLOCK, poses[1:])
    for aside in (0.0, 1e-3):
        effect = PRESTRETCH[1]
        truth, read = mounted(effect, {"along": 2e-3, "aside": aside}, poses)
        stiffness = plain[0].wrench[0] / 5e-3
        assert truth.wrench[0, 0] == pytest.approx(2e-3 * stiffness, rel=0.1)
        assert truth.wrench[0, 1] == pytest.approx(0.0, abs=1e-9) if not aside else truth.wrench[0, 1] < -0.01
        np.testing.assert_allclose(read.wrench[0], np.zeros(6), atol=1e-12)
        np.testing.assert_allclose(read.fiducials[0], REFERENCE_BLOCK.fiducials_rest, atol=1e-12)
        np.testing.assert_allclose(truth.fiducials[0], REFERENCE_BLOCK.fiducials_rest, atol=1e-3)
        hidden = abs(truth.wrench[0, 0])
        assert 0.0 < abs(read.wrench[2, 0] - plain[1].wrench[0]) < 0.1 * hidden


def test_a_phantom_drawn_from_its_stated_shape_shows_it_by_its_beads_and_not_by_its_zeroed_force() -> None:
    centre = np.array(REFERENCE_BLOCK.grasp.centre)
    reported = [
        GripperPose(centre, Rotation.identity()),
        *turning_pull(REFERENCE_BLOCK, 0.01, np.zeros(3), 2),
    ]
    effect, values = PRESTRETCH[2], {"drawn_x": 2e-3, "drawn_y": 1e-3}
    moved = effect.motion(motion_of(reported), values)
    np.testing.assert_allclose(moved.position, motion_of(reported).position + np.array([2e-3, 1e-3, 0.0]))
    true = [GripperPose(p, r) for p, r in zip(moved.position, moved.rotation, strict=True)]
    read = effect.readings(readings_of(true, observed(BLOCK, true)), values)
    np.testing.assert_allclose(read.wrench[0], np.zeros(6), atol=1e-12)
    further = read.fiducials[0] - REFERENCE_BLOCK.fiducials_rest
    assert np.linalg.norm(further, axis=1).max() > 1e-3
    assert read.wrench[1, 0] < -0.1


def test_beads_measured_after_the_tissue_was_drawn_move_as_tissue_that_lay_elsewhere_does() -> None:
    centre, drawn = np.array(REFERENCE_BLOCK.grasp.centre), np.array([1.5e-3, 1e-3, 0.0])
    reported = [
        GripperPose(centre, Rotation.identity()),
        *turning_pull(REFERENCE_BLOCK, 0.015, np.array([0.0, 0.0, 0.4]), 3),
    ]
    true = [GripperPose(pose.position + drawn, pose.rotation) for pose in reported]
    seen = np.array([one.fiducials for one in observed(BLOCK, true)])
    stated = mesh_experiment(replace(REFERENCE_BLOCK, fiducials_rest=seen[0]), TINY)
    effect, values = PRESTRETCH[3], {"drawn_x": drawn[0], "drawn_y": drawn[1]}
    changed = effect.problem(stated, values)
    truth = readings_of(true, observed(changed, true))
    experiment = replace(truth.experiment, fiducials_rest=seen[0])
    read = effect.readings(replace(truth, experiment=experiment), values)
    np.testing.assert_allclose(read.fiducials[0], seen[0], atol=1e-12)
    np.testing.assert_allclose(read.wrench[0], np.zeros(6), atol=1e-12)
    left = np.linalg.norm(read.fiducials[-1] - seen[-1], axis=1)
    in_place = np.array([one.fiducials for one in observed(stated, true)])
    without = np.linalg.norm(in_place[-1] - in_place[0] + seen[0] - seen[-1], axis=1)
    assert np.sqrt(np.mean(without**2)) > 2e-4
    assert left.max() < 5e-6


def test_a_bead_that_was_drawn_into_the_stated_grasp_is_tissue_beside_it() -> None:
    beads = np.array([[0.0305, 0.0, 0.005], [0.0325, 0.0, 0.005]])
    stated = mesh_experiment(replace(REFERENCE_BLOCK, fiducials_rest=beads), TINY)
    assert stated.fiducials_gripped.all()
    changed = PRESTRETCH[3].problem(stated, {"drawn_x": 1.5e-3, "drawn_y": 0.0})
    assert changed.fiducials_gripped.tolist() == [False, True]
    drawn = [GripperPose(stated.grasp_centre + np.array([1.5e-3, 0.0, 0.0]), Rotation.identity())]
    np.testing.assert_allclose(observed(changed, drawn)[0].fiducials, beads, atol=2e-5)


def test_the_prestretched_grasp_is_at_its_stated_place_once_mounted() -> None:
    problem = PRESTRETCH[1].problem(BLOCK, {"along": 3e-3, "aside": -1e-3})
    pose = GripperPose(np.array(REFERENCE_BLOCK.grasp.centre), Rotation.from_rotvec([0.0, 0.0, 0.3]))
    np.testing.assert_allclose(problem.gripped_positions(pose), BLOCK.gripped_positions(pose), atol=1e-12)


def test_a_zero_taken_on_the_sensor_turns_with_the_gripper() -> None:
    poses = [
        GripperPose(BLOCK.grasp_centre, Rotation.identity()),
        GripperPose(BLOCK.grasp_centre, Rotation.from_rotvec([0.0, 0.0, np.pi / 2])),
    ]
    wrench = np.array([[1.0, 0.0, 2.0, 0.3, 0.0, 0.1]] * 2)
    motion = motion_of(poses)
    none = np.zeros((2, 16, 3))
    truth = Readings(
        motion.experiment,
        motion.position,
        motion.rotation,
        motion.position,
        wrench,
        none,
        wrench[0],
        none[0],
    )
    read = GRAVITY_SAG[0].readings(truth, {"weight": 1.0})
    np.testing.assert_allclose(read.wrench, [np.zeros(6), [1.0, -1.0, 0.0, 0.3, -0.3, 0.0]], atol=1e-12)


def test_past_kinks_either_end_of_a_stretch_that_came_off_lies_one_column_of_nodes_further() -> None:
    def ends(values: Values) -> FloatArray:
        first = values["place"] * (1.0 - values["share"])
        return np.array([first, first + values["share"]])

    values = {"share": 0.3, "place": 0.4}
    moved = [ends(other) - ends(values) for other in ANCHOR_DEBONDING.past_kinks(BLOCK, values)]
    rim = rim_of(BLOCK)
    column = np.median(rim.end - rim.start)
    assert np.array(moved) == pytest.approx(column * np.array([[-1, 0], [1, 0], [0, -1], [0, 1]]), abs=1e-12)


def test_past_kinks_no_stretch_leaves_the_rim_or_vanishes() -> None:
    at_the_end = {"share": 0.05, "place": 0.0}
    found = ANCHOR_DEBONDING.past_kinks(BLOCK, at_the_end)
    assert found
    assert all(other["share"] >= 0.02 and 0.0 <= other["place"] <= 1.0 for other in found)
    assert at_the_end not in found
