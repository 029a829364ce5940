"""What happens to a rig without having a label of its own: late cameras, distorting lenses, a force axis that clips."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from effect_cases import STIFFNESS, felt, there_and_back, with_values, wrench_change
from numpy.testing import assert_allclose
from retraction_cases import REFERENCE_BLOCK

from estimator.effects.camera_lag import CameraLag
from estimator.effects.catalogue import LABELS, OUTSIDERS
from estimator.effects.force_clipping import ForceClipping
from estimator.effects.lens_distortion import LensDistortion
from estimator.effects.sticky_patch import StickyPatch
from estimator.fem.block_mesh import Grading
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
