"""Naming fiducials: at rest, through a retraction, with beads out of sight, and never a wrong name."""

import numpy as np
import pytest
from numpy.typing import NDArray

from daq.vision.errors import VisionError
from daq.vision.identity import IdentitySettings, IdentityTracker

FloatArray = NDArray[np.float64]

GRID = np.stack(np.meshgrid([-0.03, -0.01, 0.01, 0.03], [-0.03, -0.01, 0.01, 0.03]), axis=-1).reshape(-1, 2)
REST = np.column_stack([GRID, np.full(16, 0.005)])
NAMES = np.arange(16)
IMAGE_PERIOD_S = 0.1


def placed(seed: int) -> FloatArray:
    """The beads as they were really put, off the design by a millimetre or two."""
    return REST + np.random.default_rng(seed).normal(0.0, 0.001, REST.shape)


def retracted(rest: FloatArray, pull_m: float) -> FloatArray:
    """A pull of the grasp at (40, 0) mm along x: most at the grasp, none at the anchored face, narrowing sideways."""
    along = np.clip((rest[:, 0] + 0.05) / 0.09, 0.0, None)
    share = along * np.exp(-(((rest[:, 0] - 0.04) / 0.07) ** 2) - (rest[:, 1] / 0.045) ** 2)
    moved = rest.copy()
    moved[:, 0] += pull_m * share
    moved[:, 1] *= 1.0 - 4.0 * pull_m * share
    moved[:, 2] += 0.1 * pull_m * share
    return moved


def shifted(points: FloatArray, along_x_m: float) -> FloatArray:
    return points + np.array([along_x_m, 0.0, 0.0])


def shuffled(points: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, NDArray[np.intp]]:
    order = rng.permutation(len(points))
    return points[order], order


def test_beads_at_rest_get_the_names_of_the_nearest_design_positions() -> None:
    points, order = shuffled(placed(0), np.random.default_rng(1))
    assignment = IdentityTracker(REST, IdentitySettings()).assign(points, 0.0)
    np.testing.assert_array_equal(order[assignment.points], NAMES)
    assert not assignment.rejected


@pytest.mark.parametrize("seed", range(5))
def test_names_survive_a_motion_of_30_mm_in_which_beads_vanish_and_come_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rest = placed(seed)
    tracker = IdentityTracker(REST, IdentitySettings())
    tracker.assign(rest, 0.0)
    hidden_until = np.zeros(16)
    named = seen = 0
    for image in range(1, 61):
        hidden_until[rng.random(16) < 0.02] = image + 8  # eight images: 4 mm of motion
        visible = hidden_until < image
        truth = retracted(rest, 0.0005 * image) + rng.normal(0.0, 2e-5, rest.shape)
        points, order = shuffled(truth[visible], rng)
        assignment = tracker.assign(points, image * IMAGE_PERIOD_S)
        found = assignment.points >= 0
        np.testing.assert_array_equal(np.flatnonzero(visible)[order[assignment.points[found]]], NAMES[found])
        named += int(found.sum())
        seen += int(visible.sum())
    assert np.linalg.norm(truth - rest, axis=1).max() > 0.02
    assert named > 0.99 * seen


def test_dirt_beside_a_hidden_bead_is_not_taken_for_it() -> None:
    rest = placed(2)
    tracker = IdentityTracker(REST, IdentitySettings())
    tracker.assign(rest, 0.0)
    dirt = rest[5] + [0.0025, 0.0, 0.0]
    points = np.vstack([np.delete(rest, 5, axis=0), dirt])
    assignment = tracker.assign(points, IMAGE_PERIOD_S)
    assert assignment.points[5] == -1
    assert assignment.rejected == {"unclaimed point": 1}


def test_two_beads_where_one_is_expected_leave_it_unseen() -> None:
    rest = placed(3)
    tracker = IdentityTracker(REST, IdentitySettings())
    tracker.assign(rest, 0.0)
    moved = shifted(rest, 0.0005)
    twins = moved[7] + 0.0004 * np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    assignment = tracker.assign(np.vstack([np.delete(moved, 7, axis=0), twins]), IMAGE_PERIOD_S)
    assert assignment.points[7] == -1
    assert assignment.rejected == {"ambiguous identity": 1, "unclaimed point": 2}


def test_the_motion_of_the_neighbours_tells_a_bead_from_dirt_that_stays_behind() -> None:
    rest = placed(3)
    tracker = IdentityTracker(REST, IdentitySettings())
    tracker.assign(rest, 0.0)
    points = np.vstack([shifted(rest, 0.001), shifted(rest, 0.0)[7]])
    np.testing.assert_array_equal(tracker.assign(points, IMAGE_PERIOD_S).points, NAMES)


def test_a_sheet_that_shifts_by_one_row_unseen_is_lost_and_not_renamed() -> None:
    rest = placed(4)
    tracker = IdentityTracker(REST, IdentitySettings())
    tracker.assign(rest, 0.0)
    for image in range(1, 21):
        tracker.assign(np.empty((0, 3)), image * IMAGE_PERIOD_S)
    assignment = tracker.assign(shifted(rest, 0.02), 2.1)
    assert (assignment.points == -1).all()
    assert assignment.rejected == {"lost fiducial": 16, "unclaimed point": 16}


def test_a_gap_in_which_a_row_can_take_the_place_of_the_next_is_not_bridged() -> None:
    rest = placed(4)
    tracker = IdentityTracker(REST, IdentitySettings())
    tracker.assign(rest, 0.0)
    assignment = tracker.assign(shifted(rest, 0.02), 1.0)
    assert (assignment.points == -1).all()


def test_what_was_lost_in_a_gap_is_found_again_when_every_bead_is_back() -> None:
    rest = placed(4)
    tracker = IdentityTracker(REST, IdentitySettings())
    tracker.assign(rest, 0.0)
    partly = tracker.assign(np.delete(rest, [1, 6, 11], axis=0), 1.0)
    assert (partly.points == -1).all()
    np.testing.assert_array_equal(tracker.assign(shifted(rest, 0.003), 1.1).points, NAMES)


def test_a_missing_image_is_bridged() -> None:
    rest = placed(4)
    tracker = IdentityTracker(REST, IdentitySettings())
    tracker.assign(rest, 0.0)
    np.testing.assert_array_equal(tracker.assign(shifted(rest, 0.004), 0.4).points, NAMES)


def test_a_short_blackout_without_motion_loses_no_name() -> None:
    rest = placed(5)
    tracker = IdentityTracker(REST, IdentitySettings())
    tracker.assign(rest, 0.0)
    tracker.assign(np.empty((0, 3)), IMAGE_PERIOD_S)
    np.testing.assert_array_equal(tracker.assign(rest, 2 * IMAGE_PERIOD_S).points, NAMES)


def test_a_grid_that_is_off_by_one_row_at_rest_is_refused() -> None:
    with pytest.raises(VisionError, match=r"fiducials 0, 4, 8, 12 \(16 beads seen"):
        IdentityTracker(REST, IdentitySettings()).assign(shifted(placed(6), 0.02), 0.0)


def test_a_bead_hidden_at_first_is_named_when_it_appears() -> None:
    rest = placed(7)
    tracker = IdentityTracker(REST, IdentitySettings())
    first = tracker.assign(np.delete(rest, 3, axis=0), 0.0)
    assert first.points[3] == -1
    np.testing.assert_array_equal(tracker.assign(rest, IMAGE_PERIOD_S).points, NAMES)


def test_images_out_of_order_are_refused() -> None:
    tracker = IdentityTracker(REST, IdentitySettings())
    tracker.assign(REST, 1.0)
    with pytest.raises(VisionError, match="sort them by time"):
        tracker.assign(REST, 0.9)
