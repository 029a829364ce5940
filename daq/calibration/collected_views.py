"""Views of a ChArUco board, collected one by one while a person moves it before the cameras, and what all of them need.

One camera or a pair sees the board; what is computed from the views is in :mod:`daq.calibration.one_camera` and
:mod:`daq.calibration.cameras`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from matplotlib.figure import Figure as Plot
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from daq.calibration_files.outcome import Figure
from daq.errors import CalibrationError
from daq.frames import pose
from daq.rig import Rig
from daq.vision.board_finding import find_out
from daq.vision.calibration import LensCalibration
from daq.vision.charuco import BoardView, CharucoBoard
from daq.vision.errors import VisionError
from robot_drivers.protocols import FloatArray, Pose

CELLS = (6, 8)
"""Rows and columns of the map of coverage."""

FEWEST_VIEWS = 12
LEAST_COVERAGE = 0.7
LEAST_TILT_DEG = 25.0
MOST_RMS_PX = 0.3
MOST_FOCAL_STD = 2e-3

SIDES = ("left", "right")
ONLY = ("only",)
"""Who sees the board: the cameras of a pair, or the only one of a rig."""

# OpenCV names a mosaic by the colours of its second row
_TO_GREY = {
    "bgr8": cv2.COLOR_BGR2GRAY,
    "bayer_rggb8": cv2.COLOR_BayerBG2GRAY,
    "bayer_grbg8": cv2.COLOR_BayerGB2GRAY,
    "bayer_gbrg8": cv2.COLOR_BayerGR2GRAY,
    "bayer_bggr8": cv2.COLOR_BayerRG2GRAY,
}


@dataclass(frozen=True, slots=True)
class ViewFigures:
    """How a collection stands after a view; of each camera that sees the board one number.

    Attributes
    ----------
    views : that were taken
    corners : of this view
    coverage : share of the cells of each image in which a corner has been seen
    problem : why this view was not taken; empty if it was
    note : what else there is to know
    """

    views: int
    corners: tuple[int, ...]
    coverage: tuple[float, ...]
    problem: str = ""
    note: str = ""

    def describe(self) -> str:
        """Return one line."""
        if self.problem:
            return f"not taken: {self.problem}"
        corners = " / ".join(str(count) for count in self.corners)
        covered = " / ".join(f"{share:.0%}" for share in self.coverage)
        line = f"view {self.views}: {corners} corners, coverage {covered}"
        return f"{line}; {self.note}" if self.note else line


class BoardViews:
    """Collects views; the first one shows the board at a known place.

    Parameters
    ----------
    board : as measured on the print
    sides : who sees it, :data:`SIDES` or :data:`ONLY`

    Attributes
    ----------
    taken : views of one moment each, by side
    names : of the views, for what is told about them later
    """

    def __init__(self, board: CharucoBoard, sides: Sequence[str] = SIDES) -> None:
        self.board = board
        self.sides = tuple(sides)
        self.taken: list[tuple[BoardView, ...]] = []
        self.names: list[str] = []
        self._image_size: tuple[int, int] | None = None

    def add(self, *images: NDArray[np.uint8], name: str = "") -> ViewFigures:
        """Take grey images (height, width) of one moment, one of each side, and tell how the collection stands.

        A board of the other layout of OpenCV than was said is taken as what it is.

        Raises
        ------
        CalibrationError
            The images are not one of each side, or not of one size.
        """
        size = self._size_of(images)
        try:
            seen, note = self._seen(images)
        except VisionError as error:
            return ViewFigures(len(self.taken), (0,) * len(self.sides), self.coverage, str(error))
        self._image_size = size
        self.taken.append(seen)
        self.names.append(name or f"view {len(self.taken)}")
        corners = tuple(len(view.numbers) for view in seen)
        return ViewFigures(len(self.taken), corners, self.coverage, note=note)

    def _size_of(self, images: Sequence[NDArray[np.uint8]]) -> tuple[int, int]:
        """Return the width and height, px, of all images that were taken and these."""
        if len(images) != len(self.sides):
            raise CalibrationError(
                f"board: {len(images)} images of one moment, but {len(self.sides)} cameras are to see it"
            )
        sizes = {(image.shape[1], image.shape[0]): None for image in images}
        if self._image_size is not None:
            sizes[self._image_size] = None
        if len(sizes) > 1:
            told = " and ".join(f"{width} x {height}" for width, height in sizes)
            raise CalibrationError(f"board: images of {told} px; all have to be of one size")
        return next(iter(sizes))

    def _seen(self, images: Sequence[NDArray[np.uint8]]) -> tuple[tuple[BoardView, ...], str]:
        """Return the board in each image, and a note on it; before the first view the print may prove another one."""
        note = ""
        if not self.taken:
            for image in images:
                try:
                    self.board.detect(image)
                except VisionError:
                    finding = find_out(image, self.board)
                    if finding.board is None:
                        raise VisionError(finding.words) from None
                    self.board, note = finding.board, finding.words
        return tuple(
            self._in_image(image, side) for image, side in zip(images, self.sides, strict=True)
        ), note

    def _in_image(self, image: NDArray[np.uint8], side: str) -> BoardView:
        try:
            return self.board.detect(image)
        except VisionError as error:
            raise VisionError(f"{side} {error}" if len(self.sides) > 1 else str(error)) from error

    @property
    def coverage(self) -> tuple[float, ...]:
        """Share of the cells of each image in which a corner has been seen."""
        return tuple(float(np.mean(counts > 0)) for counts in self.coverage_maps())

    def coverage_maps(self) -> tuple[NDArray[np.int64], ...]:
        """Return how many corners were seen in each cell of the image of each side."""
        return tuple(self._counts(side) for side in range(len(self.sides)))

    def _counts(self, side: int) -> NDArray[np.int64]:
        counts = np.zeros(CELLS, dtype=np.int64)
        if self._image_size is not None:
            pixels = np.concatenate([views[side].pixels for views in self.taken])
            cells = pixels / self._image_size * (CELLS[1], CELLS[0])
            columns, rows = np.clip(cells.astype(np.intp), 0, (CELLS[1] - 1, CELLS[0] - 1)).T
            np.add.at(counts, (rows, columns), 1)
        return counts

    def enough(self) -> tuple[int, int]:
        """Return width and height of the images, px.

        Raises
        ------
        CalibrationError
            There are too few views.
        """
        if self._image_size is None or len(self.taken) < FEWEST_VIEWS:
            raise CalibrationError(
                f"board: {len(self.taken)} views were taken, {FEWEST_VIEWS} are needed; show the board in the whole "
                "field, near and far, tilted up to 45°"
            )
        return self._image_size

    def figures(self, *, first_is_there: bool = True) -> tuple[Figure, ...]:
        """Return what speaks for or against the views: how many, how well they cover the images, and their first."""
        shares = [
            Figure(f"{side} coverage" if len(self.sides) > 1 else "coverage", share, "", least=LEAST_COVERAGE)
            for side, share in zip(self.sides, self.coverage, strict=True)
        ]
        known_place = (
            [] if first_is_there else [Figure("views of the board at its known place", 0.0, "", least=1.0)]
        )
        return (Figure("views", float(len(self.taken)), "", least=float(FEWEST_VIEWS)), *shares, *known_place)

    def draw(self, plot: Plot, rms_px: FloatArray) -> None:
        """Draw where corners were seen, and the reprojection error of each view, (views,) or (sides, views)."""
        *maps, views = plot.subplots(1, len(self.sides) + 1)
        for axes, side, counts in zip(maps, self.sides, self.coverage_maps(), strict=True):
            image = axes.imshow(counts, cmap="Blues", aspect="auto")
            of_side = f", {side}" if len(self.sides) > 1 else ""
            axes.set(title=f"corners seen{of_side}", xticks=[], yticks=[])
            axes.grid(visible=False)
            plot.colorbar(image, ax=axes, shrink=0.6)
        views.plot(np.atleast_2d(rms_px).T, "o-")
        views.set(xlabel="view", ylabel="reprojection, rms px", ylim=(0.0, None))


def lying_on_phantom(board: CharucoBoard, rig: Rig) -> Pose:
    """Return ``T_tissue_board`` of a board that lies on the middle of the phantom, its columns along -y, print up."""
    along, across = board.columns * board.square_m / 2, board.rows * board.square_m / 2
    facing = Rotation.from_matrix([[0, -1, 0], [-1, 0, 0], [0, 0, -1]])
    return pose((across, along, rig.specimen.phantom.size_m[2] / 2), facing)


def grey(image: NDArray[np.uint8], pixel_format: str) -> NDArray[np.uint8]:
    """Return the grey levels (height, width) of a camera's image."""
    if pixel_format == "mono8":
        return image
    return np.asarray(cv2.cvtColor(image, _TO_GREY[pixel_format]), dtype=np.uint8)


def tilt_deg(lens: LensCalibration) -> float:
    """Return the largest angle between the board's normal and the optical axis, as the board faces the camera."""
    along = np.abs(lens.rotations.as_matrix()[:, 2, 2])
    return math.degrees(math.acos(float(np.clip(along.min(), 0.0, 1.0))))
