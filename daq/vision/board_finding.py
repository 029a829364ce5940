"""Why no board is found in an image: what its markers tell about the board that was printed.

The places of the markers of a ChArUco board follow from its columns and from which colour its first square has. So
markers that are seen, by their numbers, tell both: of all boards that may be, the right one's markers are those that a
plane's perspective carries onto the image.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from daq.vision.charuco import CharucoBoard

FloatArray = NDArray[np.float64]

_FEWEST_MARKERS = 6
_MOST_SQUARES = 40
_MOST_OFF = 0.15  # squares, of a marker from its place on the right board; a lens bends that little
_MOST_TRIES = 200  # with most markers in place, the first few suffice
_LEAST_SHARE = 0.8  # of the markers; one that is read wrong is somewhere else
_USUAL_CHESSBOARDS = ((10, 7), (9, 7), (9, 6), (8, 8), (8, 7), (8, 6), (7, 6), (12, 9))  # squares
_FEWEST_SQUARES = 3  # a board has as many or more each way


@dataclass(frozen=True, slots=True)
class Markers:
    """Markers in an image: numbers (n,) and centres (n, 2), px."""

    numbers: NDArray[np.intp]
    centres: FloatArray


@dataclass(frozen=True, slots=True)
class Finding:
    """What an image tells about the board.

    Attributes
    ----------
    words : what was found and what would help
    board : the board as it is printed, where only its layout is another than was said; else None
    """

    words: str
    board: CharucoBoard | None = None


def find_out(image: NDArray[np.uint8], board: CharucoBoard) -> Finding:
    """Tell why ``board`` is not found in a grey image."""
    markers = markers_in(image, board.dictionary)
    if len(markers.numbers) < _FEWEST_MARKERS:
        return Finding(_without_markers(image, board, len(markers.numbers)))
    seen = f"{len(markers.numbers)} markers of {board.dictionary} are seen"
    fitting = _fitting(markers, board)
    if fitting is None:
        return Finding(
            f"{seen}, but as on no board of squares: is the print flat and whole, and are all markers of one board?"
        )
    if fitting == replace(board, legacy_pattern=not board.legacy_pattern):
        return Finding(f"{seen}, and lie as on a board {_layout(fitting)}", fitting)
    if (fitting.columns, fitting.rows) != (board.columns, board.rows):
        return Finding(f"{seen}, and lie as on a board {_shape(fitting, board)}")
    return Finding(
        f"{seen} where they belong, but too few corners between them; check light and focus, and show more of the board"
    )


def markers_in(image: NDArray[np.uint8], dictionary: str) -> Markers:
    """Return the markers of a dictionary that a grey image shows."""
    family = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    corners, numbers, _ = cv2.aruco.ArucoDetector(family).detectMarkers(image)
    if numbers is None or len(numbers) == 0:
        return Markers(np.empty(0, np.intp), np.empty((0, 2)))
    centres = np.asarray(corners, dtype=np.float64).reshape(len(numbers), 4, 2).mean(axis=1)
    return Markers(np.asarray(numbers, dtype=np.intp).ravel(), centres)


def _fitting(markers: Markers, board: CharucoBoard) -> CharucoBoard | None:
    """Return the board whose markers lie as those that are seen, the one that was said before others."""
    fits = [(_share_in_place(markers, candidate), candidate) for candidate in _candidates(markers, board)]
    share, best = max(fits, key=lambda one: one[0])
    return best if share >= _LEAST_SHARE else None


def _candidates(markers: Markers, board: CharucoBoard) -> Iterator[CharucoBoard]:
    """Yield the shapes that have markers of these numbers, in both layouts; of the rows only the evenness tells."""
    for columns in (board.columns, *range(_FEWEST_SQUARES, _MOST_SQUARES + 1)):
        fewest = max(_FEWEST_SQUARES, int(np.ceil(2 * (markers.numbers.max() + 1) / columns)))
        likely = (
            [board.rows] if columns == board.columns else [board.columns] if columns == board.rows else []
        )
        for count in (*(rows for rows in likely if rows >= fewest), fewest, fewest + 1):
            for legacy in (board.legacy_pattern, not board.legacy_pattern):
                # layouts differ for an even number of rows alone
                if (count % 2 == 0 or not legacy) and columns * count // 2 <= board.markers_in_dictionary:
                    yield replace(board, columns=columns, rows=count, legacy_pattern=legacy)


def _share_in_place(markers: Markers, board: CharucoBoard) -> float:
    """Return the share of the markers that a plane's perspective carries to their places on a board."""
    places = board.marker_centres[markers.numbers, :2] / board.square_m
    carried, inside = cv2.findHomography(markers.centres, places, cv2.RANSAC, _MOST_OFF, maxIters=_MOST_TRIES)
    return 0.0 if carried is None else float(np.mean(inside))


def _without_markers(image: NDArray[np.uint8], board: CharucoBoard, count: int) -> str:
    """Say which other dictionary's markers are seen, if any are."""
    for turned, words in (
        (
            image[:, ::-1],
            "the image is mirrored; turn mirroring off in the camera's program, or flip the images back",
        ),
        (
            255 - image,
            "the board is a negative, light where it should be dark; print it black on white, or invert the images",
        ),
    ):
        found = len(markers_in(np.ascontiguousarray(turned), board.dictionary).numbers)
        if found >= max(_FEWEST_MARKERS, 2 * count):
            return f"{count or 'no'} markers of {board.dictionary} are seen, {found} once that is undone: {words}"
    best, seen = "", 0
    for name in _families():
        numbers = markers_in(image, name).numbers
        if len(set(numbers.tolist())) > seen:
            best, seen = _smallest(name, int(numbers.max())), len(set(numbers.tolist()))
    if seen >= max(_FEWEST_MARKERS, 2 * count):
        return (
            f"{seen} markers of {best} are seen, {count or 'none'} of {board.dictionary}; the board is of another "
            f"dictionary: --dictionary {best}"
        )
    if not count and (squares := _bare_chessboard(image, board)):
        return (
            f"a chessboard of {squares[0]} x {squares[1]} squares without markers is seen; a ChArUco board is needed, "
            "whose white squares hold markers"
        )
    return (
        f"{count or 'no'} markers of {board.dictionary} are seen, and hardly any of another dictionary; check light "
        "and focus, and that the board is in the image, not mirrored and not covered"
    )


def _bare_chessboard(image: NDArray[np.uint8], board: CharucoBoard) -> tuple[int, int] | None:
    """Return the squares of a chessboard of the shape of the board, or of a usual one, that has no markers."""
    for columns, rows in dict.fromkeys(((board.columns, board.rows), *_USUAL_CHESSBOARDS)):
        if cv2.findChessboardCornersSB(image, (columns - 1, rows - 1))[0]:
            return columns, rows
    return None


def _families() -> list[str]:
    """Return the dictionaries of OpenCV that no other one contains; some have two names, 36h11 and 36H11."""
    names = sorted(name for name in dir(cv2.aruco) if name.startswith("DICT_"))
    by_number = {getattr(cv2.aruco, name): name for name in names}
    return [name for name in by_number.values() if not name.endswith(("_50", "_100", "_250"))]


def _smallest(name: str, number: int) -> str:
    """Return the smallest dictionary that begins as a dictionary does and has a marker of this number."""
    head = name.removesuffix("_1000")
    sizes = [size for size in (50, 100, 250) if number < size and hasattr(cv2.aruco, f"{head}_{size}")]
    return f"{head}_{sizes[0]}" if sizes and head != name else name


def _layout(board: CharucoBoard) -> str:
    if board.legacy_pattern:
        return (
            "printed by OpenCV before 4.6, whose boards with an even number of rows begin with the other colour: taken "
            "as with --legacy-pattern"
        )
    return "printed by OpenCV 4.6 or later: taken as without --legacy-pattern"


def _shape(found: CharucoBoard, said: CharucoBoard) -> str:
    legacy = " --legacy-pattern" if found.legacy_pattern else ""
    if (found.columns, found.rows) == (said.rows, said.columns):
        return (
            f"of {found.columns} columns and {found.rows} rows, not {said.columns} and {said.rows}: they are "
            f"swapped; --columns {found.columns} --rows {found.rows}{legacy}"
        )
    return (
        f"of {found.columns} columns and {found.rows} rows or more, not {said.columns} and {said.rows}; count the "
        f"squares: --columns {found.columns} --rows {found.rows}{legacy}"
    )
