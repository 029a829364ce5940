"""What happens to a rig without having a label of its own: late or creeping cameras, lenses, clipping axes, cables."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from effect_cases import STIFFNESS, at_null, felt, measured, there_and_back, with_values, wrench_change
from numpy.testing import assert_allclose
from retraction_cases import REFERENCE_BLOCK, SMALL_BLOCK

from estimator.effects.catalogue import LABELS, OUTSIDERS
from estimator.effects.outside.cable import Cable
from estimator.effects.outside.camera_creep import CameraCreep
from estimator.effects.outside.camera_lag import CameraLag
from estimator.effects.outside.cut import Cut
from estimator.effects.outside.force_clipping import ForceClipping
from estimator.effects.outside.lens_distortion import LensDistortion
from estimator.effects.outside.loose_bead import LooseBead
from estimator.effects.outside.modulus_drift import ModulusDrift
from estimator.effects.outside.slanted_view import SlantedView
from estimator.effects.outside.sticky_patch import StickyPatch
from estimator.effects.outside.zero_jump import ZeroJump
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.discretisation.quadrature import quadrature_points
from estimator.forward.meshing import mesh_experiment
from estimator.materials import NeoHookean
from estimator.materials.material import Material

SPEED = 0.01 / (20 * 4.0)  # m/s of the beads along x


def test_what_has_no_label_is_told_as_unknown():
    assert {effect.label for effect in OUTSIDERS} == {"unknown"}
    assert "unknown" not in LABELS


@pytest.mark.parametrize(("form", "sign"), [("camera_lag", -1.0), ("camera_lead", 1.0)])
def test_late_cameras_see_moving_beads_behind_and_standing_ones_where_they_are(form, sign):
    readings = felt(there_and_back())
    shifted = CameraLag(form).readings(readings, {"shift": 0.1})
    change = shifted.fiducials - readings.fiducials
    assert_allclose(change[10, :, 0], sign * 0.1 * SPEED)
    assert_allclose(change[30, :, 0], -sign * 0.1 * SPEED)  # on the way back
    assert_allclose(change[23], 0.0, atol=1e-12)
    assert_allclose(shifted.wrench, readings.wrench)


def test_lenses_distort_as_those_of_opencv_do():
    readings = felt(there_and_back())
    values = {"radial": 3.0, "decentring_x": 0.08, "decentring_y": -0.05}
    seen = LensDistortion("true").readings(readings, values).fiducials
    plane = readings.fiducials.reshape(-1, 3).copy()
    plane[:, 2] = 1.0
    # OpenCV's tangential coefficients come in the other order.
    coefficients = np.array([3.0, 0.0, -0.05, 0.08])
    expected, _ = cv2.projectPoints(plane, np.zeros(3), np.zeros(3), np.eye(3), coefficients)
    assert_allclose(seen.reshape(-1, 3)[:, :2], expected[:, 0], atol=1e-12)
    assert_allclose(seen[..., 2], readings.fiducials[..., 2])


def test_lenses_that_measured_the_rest_too_show_no_error_there():
    readings = felt(there_and_back())
    values = with_values(LensDistortion("true"), {"radial": 3.0})
    seen = LensDistortion("measured").readings(readings, values).fiducials
    assert_allclose(seen[0], readings.experiment.fiducials_rest, atol=1e-15)
    moved = seen - readings.fiducials
    assert np.abs(moved[22]).max() > 1e-5


def test_an_axis_that_clips_reads_its_limit_and_the_others_what_is_there():
    readings = felt(
        there_and_back(turn_rad=(0.0, 0.0, np.pi / 2)), np.array([0.0, -3.0, 0.2, 0.0, 0.0, 0.01])
    )
    # At the farthest the gripper has turned by 90°: what pulls along -y of the tissue pulls along -x of the sensor.
    change = wrench_change(ForceClipping(), readings, axis=0.0, limit=2.5, lost_share=1.0)
    assert_allclose(change[22], [0.0, 0.5, 0.0, 0.0, 0.0, 0.0], atol=1e-12)
    assert_allclose(change[0], 0.0, atol=1e-12)


def test_a_search_begins_at_the_axis_that_clips_and_near_its_limit():
    readings = felt(there_and_back())
    limit = 0.75 * STIFFNESS * 0.02
    wrench = readings.wrench.copy()
    wrench[:, 0] = np.clip(wrench[:, 0], -limit, limit)
    clipped = replace(readings, experiment=replace(readings.experiment, wrench=wrench))
    start = ForceClipping().starts([clipped])[0]
    assert start["axis"] == 0.0
    assert start["limit"] == pytest.approx(limit, rel=0.06)


def test_a_sticky_patch_holds_what_lies_in_it_by_its_stiffness_times_its_area():
    problem = mesh_experiment(REFERENCE_BLOCK, Grading(2e-3, 4e-3, 4e-3, 2.0, 1))
    values = {"stiffness_over_modulus": 300.0, "centre_x": -0.01, "centre_y": 0.005, "radius": 0.012}
    material = Material(NeoHookean(), 15e3, 0.45)
    (springs,) = StickyPatch().terms(problem, material, REFERENCE_BLOCK, values)
    moved = np.tile([1e-3, 0.0, 0.0], (len(problem.body.mesh.points), 1))
    force = springs.forces(moved, None)
    expected = 300.0 * 15e3 * np.pi * 0.012**2 * 1e-3
    assert force.sum(axis=0) == pytest.approx([expected, 0.0, 0.0], rel=0.05)
    held = problem.body.mesh.points[np.abs(force[:, 0]) > 0.01 * np.abs(force[:, 0]).max()]
    assert held[:, 2] == pytest.approx(-0.005)
    assert np.linalg.norm(held[:, :2] - [-0.01, 0.005], axis=1).max() < 0.017


def test_a_cut_is_looked_for_within_the_region_that_it_is_mistaken_for():
    readings = felt(there_and_back())
    within = Cut().looked_for_at(np.array([0.01, -0.02, 0.0]), 0.008)
    starts = within.starts([readings])
    assert {(start["centre_x"], start["centre_y"], start["half_length"]) for start in starts} == {
        (0.01, -0.02, 0.008)
    }
    assert sorted(start["normal"] for start in starts) == [0.0, np.pi / 2]
    assert within.name == Cut().name
    assert len(Cut().starts([readings])) > 2 * 20


def test_a_cut_bears_next_to_nothing_within_and_all_beyond_its_ends_and_beside_it():
    mesh = mesh_experiment(SMALL_BLOCK, Grading(1e-3, 1e-3, 1e-3, 1.0, 1))
    values = {
        "log_softness": 4.0,
        "centre_x": 0.0,
        "centre_y": 0.0,
        "half_length": 0.008,
        "normal": np.pi / 6,
    }
    left = np.exp(Cut().log_modulus(mesh, values))
    arms = quadrature_points(mesh.body.mesh)[..., :2]
    across, along = arms @ [np.cos(np.pi / 6), 0.5], arms @ [-0.5, np.cos(np.pi / 6)]
    within = np.hypot(across / 0.0005, along / 0.007) < 1.0
    beyond = (np.abs(along) > 0.012) | (np.abs(across) > 0.006)
    assert within.any()
    assert left[within].max() < 0.25
    assert left[beyond].min() > 0.95
    assert Cut().log_modulus(mesh, {**values, "log_softness": 0.0}) is None


def test_a_drifting_modulus_scales_every_force_by_the_time_since_the_first_experiment_began():
    values = {"log_modulus_per_second": 1e-3, "log_modulus_per_experiment": 0.02}
    readings = felt(there_and_back(order=3))
    drifted = ModulusDrift().readings(readings, values)
    assert drifted.wrench[30] == pytest.approx(np.exp(1e-3 * 120.0 + 0.04) * readings.wrench[30])
    assert_allclose(drifted.fiducials, readings.fiducials)


def test_cameras_that_creep_see_all_beads_move_as_one_body_from_rest_on():
    readings = felt(there_and_back())
    seen = CameraCreep().readings(readings, with_values(CameraCreep(), {"velocity_y": 1e-5, "rate_z": 1e-4}))
    change = seen.fiducials - readings.fiducials
    x, y, _ = np.moveaxis(readings.fiducials[40], -1, 0)
    assert_allclose(change[0], 0.0)
    assert_allclose(change[40, :, 0], 160.0 * -1e-4 * y)
    assert_allclose(change[40, :, 1], 160.0 * (1e-5 + 1e-4 * x))


def test_a_slanted_view_shifts_a_bead_by_how_far_it_has_sunk():
    readings = felt(there_and_back())
    beads = readings.fiducials.copy()
    beads[22, 3, 2] -= 2e-3
    values = with_values(SlantedView(), {"shift_x_per_depth": 0.1, "shift_z_per_depth": -0.25})
    change = SlantedView().readings(readings.with_fiducials(beads), values).fiducials - beads
    assert change[22, 3] == pytest.approx([2e-4, 0.0, -5e-4])
    assert np.abs(np.delete(change[22], 3, axis=0)).max() < 1e-15


def test_a_cable_pulls_its_hook_towards_its_end_once_the_slack_is_out():
    readings = felt(there_and_back())
    ends = {"end_x": -0.3, "end_y": 0.0, "end_z": 0.08, "hook_height": 0.08, "slack": 0.004}
    change = wrench_change(Cable(), readings, stiffness=5.0, **ends)
    # 20 mm along x, away from the end: 16 mm beyond the slack.
    assert change[22] == pytest.approx([-0.08, 0.0, 0.0, 0.0, -0.0064, 0.0])
    assert change[3] == pytest.approx(np.zeros(6))


def test_a_cable_never_pushes():
    ends = {"end_x": 0.3, "end_y": 0.0, "end_z": 0.08, "hook_height": 0.08, "slack": 0.0}
    assert_allclose(wrench_change(Cable(), felt(there_and_back()), stiffness=5.0, **ends), 0.0)


def test_a_hook_that_turns_with_the_tool_stretches_the_cable_though_the_gripper_stays():
    turning = felt(there_and_back(turn_rad=(0.0, np.pi / 2, 0.0)))
    still = np.broadcast_to(turning.position[0], turning.position.shape)
    ends = {"end_x": -0.3, "end_y": 0.0, "end_z": 0.0, "hook_height": 0.1, "slack": 0.0}
    change = wrench_change(Cable(), replace(turning, position=still), stiffness=2.0, **ends)
    # The hook has gone from above the gripper to beside it, 0.4 m from the cable's end.
    stretch = 0.4 - np.hypot(0.3, 0.1)
    assert change[22] == pytest.approx([-2.0 * stretch, 0.0, 0.0, 0.0, 0.0, 0.0], abs=1e-12)


def test_a_zero_that_jumps_is_off_in_the_sensors_axes_to_the_end_of_its_experiment():
    turning = felt(there_and_back(order=2, turn_rad=(0.0, 0.0, np.pi / 2)), np.zeros(6))
    jump = {"order": 2.0, "time": 88.0, "jump_fx": 0.1, "jump_tz": 0.002}
    change = wrench_change(ZeroJump(), turning, **jump)
    assert_allclose(change[:22], 0.0)
    # The gripper has turned by 90 degrees about z: what is off along x of the sensor is so along y of the tissue.
    assert change[22] == pytest.approx([0.0, 0.1, 0.0, 0.0, 0.0, 0.002])
    assert change[-1] == pytest.approx([0.1, 0.0, 0.0, 0.0, 0.0, 0.002])
    assert_allclose(wrench_change(ZeroJump(), felt(there_and_back(order=3)), **jump), 0.0)


def test_a_search_for_a_jump_begins_where_the_wrench_jumps():
    readings = felt(there_and_back(order=2))
    off = np.outer(np.arange(46) >= 30, [0.0, 0.05, 0.0, 0.0, 0.0, 0.0])
    jumped = replace(readings, experiment=replace(readings.experiment, wrench=readings.wrench + off))
    assert ZeroJump().starts([felt(there_and_back()), jumped])[1] == {"order": 2.0, "time": 118.0}


def test_a_loose_bead_slides_as_the_tissue_moves_farther_than_before_and_stays_there():
    readings = felt(there_and_back(order=2))
    values = {"bead": 5.0, "order": 2.0, "onset": 0.5, "span": 0.25, "slide_y": 1e-3}
    change = LooseBead().readings(readings, with_values(LooseBead(), values)).fiducials - readings.fiducials
    assert change[10, 5] == pytest.approx(np.zeros(3))
    assert change[12, 5] == pytest.approx([0.0, 0.4e-3, 0.0])  # 0.6 of the way
    assert change[40, 5] == pytest.approx([0.0, 1e-3, 0.0])  # half way back
    assert_allclose(np.delete(change, 5, axis=1), 0.0)


def test_a_search_for_a_loose_bead_begins_at_the_one_that_slid():
    before, during = felt(there_and_back(order=1)), felt(there_and_back(order=2))
    slid = {"bead": 7.0, "order": 2.0, "onset": 0.4, "span": 0.15, "slide_x": 4e-4}
    seen = LooseBead().readings(during, with_values(LooseBead(), slid)).fiducials
    start = LooseBead().starts([before, measured(during, seen)])[0]
    assert start == {"bead": 7.0, "order": 2.0, "onset": 0.4, "span": 0.15}


@pytest.mark.parametrize("effect", OUTSIDERS, ids=lambda effect: effect.form)
def test_an_outsider_without_its_amplitudes_changes_no_reading(effect):
    readings = felt(there_and_back())
    constants = {constant.name: constant.grid[0] if constant.grid else 0.0 for constant in effect.constants}
    untouched = effect.readings(readings, {**constants, **at_null(effect)})
    assert_allclose(untouched.wrench, readings.wrench, atol=1e-14)
    assert_allclose(untouched.fiducials, readings.fiducials, atol=1e-14)
