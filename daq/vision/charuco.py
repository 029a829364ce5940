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
        if not self.dictionary.startswith("DICT_") or not hasattr(cv2.aruco, self.dictionary):
            raise ValueError(f"dictionary {self.dictionary!r} is none of OpenCV's, such as 'DICT_4X4_100'")

    @property
    def corners(self) -> FloatArray:
        """Inner corners (n, 3) in the board frame, m, in the order of their numbers."""
        return np.asarray(self._board().getChessboardCorners(), dtype=np.float64)

    def image(self, px_per_square: int) -> NDArray[np.uint8]:
        """Return the board to print, without margin."""
        size = (self.columns * px_per_square, self.rows * px_per_square)
        return np.asarray(self._board().generateImage(size), dtype=np.uint8)

    def detect(self, image: NDArray[np.uint8]) -> "BoardView":
        """Find the board in a grey image; raises VisionError where fewer than 8 corners are seen."""
        corners, numbers, _, _ = cv2.aruco.CharucoDetector(self._board()).detectBoard(image)
        if numbers is None or len(numbers) < _FEWEST_CORNERS:
            raise VisionError(
                f"calibration image: {0 if numbers is None else len(numbers)} board corners found, "
                f"{_FEWEST_CORNERS} are needed; check light, focus and that the board is {self.columns} x "
                f"{self.rows} squares of {self.dictionary}"
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
