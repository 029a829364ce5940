"""A board that is not found where its markers are: what was printed instead is told."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from daq.calibration.collected_views import BoardViews
from daq.vision.board_finding import find_out
from daq.vision.charuco import CharucoBoard
from daq.vision.errors import VisionError

SIZE = (1000, 800)


def image_of(board: CharucoBoard) -> NDArray[np.uint8]:
    """The print on a grey ground, seen aslant."""
    print_px = cv2.copyMakeBorder(board.image(60), *(30,) * 4, cv2.BORDER_CONSTANT, value=(255.0,))
    height, width = print_px.shape
    scale = 0.8 * min(SIZE[0] / width, SIZE[1] / height)
    corners = np.array([(0, 0), (width, 0), (width, height), (0, height)], np.float32)
    aslant = (corners * scale + (40, 60) + [(20, 0), (0, 35), (-30, 0), (0, -25)]).astype(np.float32)
    seen = cv2.warpPerspective(
        print_px,
        cv2.getPerspectiveTransform(corners, aslant),
        SIZE,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=(120.0,),
    )
    return np.asarray(cv2.GaussianBlur(seen, (3, 3), 0), dtype=np.uint8)


def board(columns: int, rows: int, dictionary: str = "DICT_4X4_100", *, legacy: bool = False) -> CharucoBoard:
    return CharucoBoard(columns, rows, dictionary=dictionary, legacy_pattern=legacy)


@pytest.mark.parametrize("legacy", [False, True])
@pytest.mark.parametrize(
    ("columns", "rows", "dictionary"),
    [(11, 8, "DICT_4X4_100"), (5, 6, "DICT_5X5_50"), (8, 10, "DICT_6X6_250"), (7, 4, "DICT_APRILTAG_36h11")],
)
def test_the_other_layout_is_recognised(columns: int, rows: int, dictionary: str, legacy: bool) -> None:
    printed = board(columns, rows, dictionary, legacy=legacy)
    said = replace(printed, legacy_pattern=not legacy)
    with pytest.raises(VisionError, match="0 board corners found"):
        said.detect(image_of(printed))
    found = find_out(image_of(printed), said)
    assert found.board == printed
    assert "--legacy-pattern" in found.words
    assert "OpenCV before 4.6" in found.words if legacy else "4.6 or later" in found.words


def test_a_board_of_an_odd_number_of_rows_has_one_layout() -> None:
    printed = board(8, 7, legacy=True)
    assert len(replace(printed, legacy_pattern=False).detect(image_of(printed)).numbers) == 42


def test_the_other_layout_is_taken_with_a_word() -> None:
    printed = board(11, 8, legacy=True)
    collected = BoardViews(board(11, 8))
    first = collected.add(image_of(printed), image_of(printed))
    assert first.problem == ""
    assert "taken as with --legacy-pattern" in first.describe()
    second = collected.add(image_of(printed), image_of(printed))
    assert (second.views, second.note, second.corners) == (2, "", (70, 70))


@pytest.mark.parametrize(
    ("printed", "said", "told"),
    [
        (board(11, 8), board(8, 11), "swapped; --columns 11 --rows 8"),
        (board(8, 11), board(11, 8), "swapped; --columns 8 --rows 11"),
        (board(6, 9), board(9, 6, legacy=True), "swapped; --columns 6 --rows 9"),
        (board(11, 8, legacy=True), board(8, 11), "swapped; --columns 11 --rows 8 --legacy-pattern"),
        (board(9, 7), board(10, 7), "--columns 9 --rows 7"),
        (board(12, 8), board(11, 8), "--columns 12 --rows 8"),
        (board(11, 8), board(11, 6), "--columns 11 --rows 8"),
        (board(11, 8, legacy=True), board(11, 9), "--columns 11 --rows 8 --legacy-pattern"),
        (board(9, 7, "DICT_5X5_100"), board(9, 7), "--dictionary DICT_5X5_50"),
        (board(9, 7), board(9, 7, "DICT_6X6_250"), "--dictionary DICT_4X4_50"),
        (board(9, 7, "DICT_ARUCO_ORIGINAL"), board(9, 7), "--dictionary DICT_ARUCO_ORIGINAL"),
        (board(9, 7, "DICT_APRILTAG_36h11"), board(9, 7), "--dictionary DICT_APRILTAG_36h11"),
    ],
)
def test_another_board_is_told_with_what_to_write(
    printed: CharucoBoard, said: CharucoBoard, told: str
) -> None:
    collected = BoardViews(said)
    problem = collected.add(image_of(printed), image_of(printed)).problem
    assert told in problem
    assert "markers of DICT_" in problem
    assert "\n" not in problem


def test_an_image_without_a_board_is_told_as_that() -> None:
    found = find_out(np.full(SIZE[::-1], 120, np.uint8), board(11, 8))
    assert found.board is None
    assert found.words.startswith("no markers of DICT_4X4_100 are seen")


def test_a_board_of_more_markers_than_its_dictionary_has_is_refused() -> None:
    with pytest.raises(ValueError, match="20 x 20 squares needs 200 markers, DICT_4X4_100 has 100"):
        board(20, 20)


@pytest.mark.parametrize(
    ("columns", "rows", "legacy"), [(11, 8, False), (11, 8, True), (9, 6, False), (14, 7, False)]
)
def test_a_mirrored_image_and_a_negative_are_told(columns: int, rows: int, legacy: bool) -> None:
    printed = board(columns, rows, legacy=legacy)
    mirrored = np.ascontiguousarray(image_of(printed)[:, ::-1])
    assert "the image is mirrored" in find_out(mirrored, printed).words
    assert "the board is a negative" in find_out(255 - image_of(printed), printed).words


@pytest.mark.parametrize(("columns", "rows"), [(11, 8), (9, 6)])
def test_a_chessboard_without_markers_is_told(columns: int, rows: int) -> None:
    squares = (np.indices((rows, columns)).sum(axis=0) % 2 * 255).astype(np.uint8)
    print_px = np.kron(squares, np.ones((60, 60), np.uint8))
    seen = cv2.copyMakeBorder(print_px, *(60,) * 4, cv2.BORDER_CONSTANT, value=(255.0,))
    words = find_out(np.asarray(seen, dtype=np.uint8), board(11, 8)).words
    assert f"a chessboard of {columns} x {rows} squares without markers" in words
