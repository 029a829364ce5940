"""The ChArUco board of the calibration: how it is printed, and its corners in an image.

Board frame: origin at the board's top left corner, x along the columns, y down the rows, z into the board.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from daq.vision.errors import VisionError

FloatArray = NDArray[np.float64]

_FEWEST_CORNERS = 8
_SMALLEST_SQUARE_M, _LARGEST_SQUARE_M = 5e-4, 1.0
_FEWEST_BEYOND = 3  # markers that the board cannot have: one alone may be read wrong


@dataclass(frozen=True, slots=True)
class CharucoBoard:
    """A printed board; lengths are those measured on the print, not those ordered.

    Attributes
    ----------
    columns, rows : number of squares
    square_m, marker_m : edge of a square and of a marker, m
    dictionary : name of the marker dictionary as OpenCV spells it
    legacy_pattern : whether the print is of OpenCV before 4.6, whose even-row boards start with the other
        colour
    """

    columns: int = 11
    rows: int = 8
    square_m: float = 0.008
    marker_m: float = 0.006
    dictionary: str = "DICT_4X4_100"
    legacy_pattern: bool = False

    def __post_init__(self) -> None:
        if not 0.0 < self.marker_m < self.square_m or min(self.columns, self.rows) < 3:
            raise ValueError("a board needs 3 x 3 squares or more, and markers smaller than its squares")
        if not _SMALLEST_SQUARE_M <= self.square_m <= _LARGEST_SQUARE_M:
            raise ValueError(
                f"a square of {1e3 * self.square_m:g} mm is on no board, which have 0.5 mm to 1 m; "
                "state millimetres as measured on the print"
            )
        if not self.dictionary.startswith("DICT_") or not hasattr(cv2.aruco, self.dictionary):
            raise ValueError(f"dictionary {self.dictionary!r} is none of OpenCV's, such as 'DICT_4X4_100'")
        if self.columns * self.rows // 2 > self.markers_in_dictionary:
            raise ValueError(
                f"a board of {self.columns} x {self.rows} squares needs {self.columns * self.rows // 2} markers, "
                f"{self.dictionary} has {self.markers_in_dictionary}; check columns, rows and dictionary"
            )

    @property
    def corners(self) -> FloatArray:
        """Inner corners (n, 3) in the board frame, m, in the order of their numbers."""
        return np.asarray(self._board().getChessboardCorners(), dtype=np.float64)

    @property
    def marker_centres(self) -> FloatArray:
        """Middles (m, 3) of the markers in the board frame, m, in the order of their numbers."""
        return np.asarray(self._board().getObjPoints(), dtype=np.float64).reshape(-1, 4, 3).mean(axis=1)

    @property
    def markers_in_dictionary(self) -> int:
        """How many markers the dictionary has."""
        return len(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, self.dictionary)).bytesList)

    def image(self, px_per_square: int) -> NDArray[np.uint8]:
        """Return the board to print, without margin."""
        size = (self.columns * px_per_square, self.rows * px_per_square)
        return np.asarray(self._board().generateImage(size), dtype=np.uint8)

    def detect(self, image: NDArray[np.uint8]) -> "BoardView":
        """Find the board in a grey image.

        Raises
        ------
        VisionError
            Fewer than 8 corners are seen, or markers that a board of so many squares does not have.
        """
        corners, numbers, _, marker_numbers = cv2.aruco.CharucoDetector(self._board()).detectBoard(image)
        markers = np.empty(0, np.intp) if marker_numbers is None else np.asarray(marker_numbers).ravel()
        board = f"{self.columns} x {self.rows} squares of {self.dictionary}"
        if numbers is None or len(numbers) < _FEWEST_CORNERS:
            raise VisionError(
                f"calibration image: {len(markers)} markers and {0 if numbers is None else len(numbers)} board corners "
                f"found, {_FEWEST_CORNERS} corners are needed; check light, focus and that the board is {board}"
            )
        if np.sum(markers >= self.columns * self.rows // 2) >= _FEWEST_BEYOND:
            raise VisionError(
                f"calibration image: marker {markers.max()} is seen, a board of {board} ends with "
                f"{self.columns * self.rows // 2 - 1}; count its squares"
            )
        return BoardView(
            np.asarray(numbers, dtype=np.intp).ravel(), np.asarray(corners, dtype=np.float64).reshape(-1, 2)
        )

    def _board(self) -> cv2.aruco.CharucoBoard:
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, self.dictionary))
        board = cv2.aruco.CharucoBoard((self.columns, self.rows), self.square_m, self.marker_m, dictionary)
        board.setLegacyPattern(self.legacy_pattern)
        return board


@dataclass(frozen=True, slots=True)
class BoardView:
    """Corners in one image: numbers (n,) on the board and pixels (n, 2)."""

    numbers: NDArray[np.intp]
    pixels: FloatArray
