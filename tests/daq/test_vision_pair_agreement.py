"""Pairs of views whose two images are not of one moment are found, whichever and however many they are."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from daq import frames
from daq.virtual_rig.operator import board_pose
from daq.virtual_rig.rendering.scene import flea2_pair
from daq.vision.calibration import BoardPair, CalibrationReport, calibrate
from daq.vision.camera_model import PinholeCamera
from daq.vision.charuco import BoardView, CharucoBoard
from daq.vision.errors import VisionError
from robot_drivers.protocols import Pose

BOARD = CharucoBoard()
CAMERAS = flea2_pair()
SIZE = (CAMERAS.left.width, CAMERAS.left.height)
VIEWS = 16
NOISE_PX = 0.05


def seen(camera: PinholeCamera, T_tissue_board: Pose, seed: int) -> BoardView:
    corners = frames.rotation(T_tissue_board.quaternion_wxyz).apply(BOARD.corners) + T_tissue_board.position
    pixels = camera.project(corners)
    inside = np.flatnonzero(np.all((pixels > 0) & (pixels < SIZE), axis=1))
    noise = np.random.default_rng(seed).normal(0.0, NOISE_PX, (len(inside), 2))
    return BoardView(inside, pixels[inside] + noise)


@cache
def views() -> tuple[list[BoardView], list[BoardView]]:
    left, right = (
        [seen(camera, board_pose(k), 2 * k + side) for k in range(VIEWS)]
        for side, camera in enumerate((CAMERAS.left, CAMERAS.right))
    )
    return left, right


def calibrated(
    pairs: Sequence[BoardPair], told: list[tuple[str, int, int]] | None = None
) -> CalibrationReport:
    def tell(text: str, done: int, total: int) -> None:
        if told is not None:
            told.append((text, done, total))

    return calibrate(pairs, BOARD, SIZE, 0, board_pose(0), tell)


@settings(max_examples=6)
@given(wrong=st.lists(st.integers(1, VIEWS - 1), min_size=2, max_size=6, unique=True))
def test_views_of_other_moments_are_left_out_and_named(wrong: list[int]) -> None:
    left, right = views()
    order = np.arange(VIEWS)
    order[wrong] = np.roll(order[wrong], 1)
    found = calibrated([(left[k], right[j]) for k, j in enumerate(order.tolist())])
    assert set(found.rejected) == set(wrong)
    assert min(found.rejected.values()) > 3.0
    assert found.calibration.rms_px < 0.1
    assert found.calibration.baseline_m == pytest.approx(CAMERAS.baseline_m, rel=1e-3)


def test_a_board_that_was_moved_a_little_between_the_images_is_found() -> None:
    left, right = views()
    turn = Rotation.from_rotvec((0.0, 0.0, 0.01))
    before = board_pose(7)
    moved = frames.pose(
        np.add(before.position, (0.0004, 0.0, 0.0002)), frames.rotation(before.quaternion_wxyz) * turn
    )
    pairs = list(zip(left, right, strict=True))
    pairs[7] = (left[7], seen(CAMERAS.right, moved, 99))
    assert set(calibrated(pairs).rejected) == {7}


@pytest.mark.parametrize("shift", [-2, -1, 1, 2])
def test_lists_that_are_shifted_are_refused_with_by_how_much(shift: int) -> None:
    left, right = views()
    pairs = [(left[k], right[k - shift]) for k in range(VIEWS) if 0 <= k - shift < VIEWS]
    with pytest.raises(VisionError, match=rf"only \d of 1\d pairs .* counted on by {shift}\)"):
        calibrated(pairs)


def test_the_view_at_the_known_place_has_to_be_right() -> None:
    left, right = views()
    pairs = [(left[0], right[1]), *zip(left[1:], right[1:], strict=True)]
    with pytest.raises(VisionError, match=r"view of the board at its known place is off by .* take it again"):
        calibrated(pairs)


def test_all_that_is_computed_is_told_and_bounded() -> None:
    told: list[tuple[str, int, int]] = []
    found = calibrated(list(zip(*views(), strict=True)), told)
    assert found.rejected == {}
    assert [text for text, done, _ in told if done == 0] == [
        f"calibrating the left camera alone in {VIEWS} views",
        f"calibrating the right camera alone in {VIEWS} views",
        "refining both cameras and all views together",
    ]
    steps = [done for text, done, _ in told if text.startswith("refining")]
    assert steps == list(range(len(steps)))
    assert len(steps) < told[-1][2] == 100


def test_pairs_of_nothing_but_different_moments_end_with_one_line() -> None:
    left, right = views()
    order = np.random.default_rng(5).permutation(VIEWS)
    wide = [replace(right[j]) for j in order.tolist()]
    with pytest.raises(VisionError, match=r"only \d+ of 16 pairs of views agree"):
        calibrated(list(zip(left, wide, strict=True)))
