"""Lenses and the stereo pair from views of a ChArUco board, taken one by one while a person moves the board."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from matplotlib.figure import Figure as Plot
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from daq.calibration_files.outcome import HELD_OUT_SCALE, Figure, Outcome
from daq.calibration_files.results import CamerasResult, Lens
from daq.errors import CalibrationError
from daq.frames import pose
from daq.progress import Progress, silent
from daq.rig import Rig
from daq.vision.board_finding import find_out
from daq.vision.calibration import BoardPair, LensCalibration, calibrate, calibrate_lens
from daq.vision.camera_model import StereoCalibration
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
MOST_SCALE = 5e-4
MOST_HELD_OUT_M = 5e-5

SIDES = ("left", "right")

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
    """How a collection stands after a view.

    Attributes
    ----------
    views : that were taken
    corners : of this view, left and right
    coverage : share of the cells of each image in which a corner has been seen
    problem : why this view was not taken; empty if it was
    note : what else there is to know
    """

    views: int
    corners: tuple[int, int]
    coverage: tuple[float, float]
    problem: str = ""
    note: str = ""

    def describe(self) -> str:
        """Return one line."""
        if self.problem:
            return f"not taken: {self.problem}"
        line = (
            f"view {self.views}: {self.corners[0]} / {self.corners[1]} corners, "
            f"coverage {self.coverage[0]:.0%} / {self.coverage[1]:.0%}"
        )
        return f"{line}; {self.note}" if self.note else line


class BoardCalibration:
    """Collects pairs of views and calibrates from them; the first one shows the board at a known place.

    Parameters
    ----------
    board : as measured on the print
    """

    def __init__(self, board: CharucoBoard) -> None:
        self._board = board
        self._pairs: list[BoardPair] = []
        self._names: list[str] = []
        self._image_size: tuple[int, int] | None = None

    def add(self, left: NDArray[np.uint8], right: NDArray[np.uint8], name: str = "") -> ViewFigures:
        """Take a pair of grey images (height, width) that were exposed together, and tell how it stands.

        A board of the other layout of OpenCV than was said is taken as what it is. ``name`` is that of the pair, for
        what is told about it later.
        """
        size = (left.shape[1], left.shape[0])
        if left.shape != right.shape or self._image_size not in (None, size):
            raise CalibrationError(
                f"cameras: images of {left.shape} and {right.shape} px; both cameras have to deliver one size"
            )
        try:
            pair, note = self._seen((left, right))
        except VisionError as error:
            return ViewFigures(len(self._pairs), (0, 0), self.coverage, str(error))
        self._image_size = size
        self._pairs.append(pair)
        self._names.append(name or f"view {len(self._pairs)}")
        corners = (len(pair[0].numbers), len(pair[1].numbers))
        return ViewFigures(len(self._pairs), corners, self.coverage, note=note)

    def _seen(self, images: tuple[NDArray[np.uint8], NDArray[np.uint8]]) -> tuple[BoardPair, str]:
        """Return the board in both images, and a note on it; before the first view the print may prove another one."""
        note = ""
        if not self._pairs:
            for image in images:
                try:
                    self._board.detect(image)
                except VisionError:
                    finding = find_out(image, self._board)
                    if finding.board is None:
                        raise VisionError(finding.words) from None
                    self._board, note = finding.board, finding.words
        left, right = (self._in_image(image, side) for image, side in zip(images, SIDES, strict=True))
        return (left, right), note

    def _in_image(self, image: NDArray[np.uint8], side: str) -> BoardView:
        try:
            return self._board.detect(image)
        except VisionError as error:
            raise VisionError(f"{side} {error}") from error

    @property
    def coverage(self) -> tuple[float, float]:
        """Share of the cells of each image in which a corner has been seen."""
        left, right = (float(np.mean(self.coverage_map(side) > 0)) for side in (0, 1))
        return left, right

    def coverage_map(self, side: int) -> NDArray[np.int64]:
        """Return how many corners were seen in each cell of the left (0) or the right (1) image."""
        counts = np.zeros(CELLS, dtype=np.int64)
        if self._image_size is not None:
            pixels = np.concatenate([pair[side].pixels for pair in self._pairs])
            cells = pixels / self._image_size * (CELLS[1], CELLS[0])
            columns, rows = np.clip(cells.astype(np.intp), 0, (CELLS[1] - 1, CELLS[0] - 1)).T
            np.add.at(counts, (rows, columns), 1)
        return counts

    def finish_cameras(self, progress: Progress = silent) -> Outcome[CamerasResult]:
        """Calibrate each lens alone; ``progress`` is told which.

        Raises
        ------
        CalibrationError
            There are too few views.
        """
        size = self._enough()
        lenses = [
            calibrate_lens([pair[side] for pair in self._pairs], self._board.corners, size, name, progress)
            for side, name in enumerate(SIDES)
        ]
        result = CamerasResult(_lens(lenses[0], size), _lens(lenses[1], size))
        figures = [
            *self._views_figures(),
            Figure("largest tilt", tilt_deg(lenses[0]), "°", least=LEAST_TILT_DEG),
        ]
        for name, lens in zip(SIDES, lenses, strict=True):
            focal_std = float(lens.intrinsics_std[0] / lens.intrinsics[0])
            figures += [
                Figure(f"{name} reprojection, rms", lens.rms_px, "px", most=MOST_RMS_PX),
                Figure(f"{name} focal length, relative deviation", focal_std, "", most=MOST_FOCAL_STD),
            ]
        rms = np.array([lens.view_rms_px for lens in lenses])
        return Outcome("cameras", result, tuple(figures), lambda plot: self._draw(plot, rms))

    def finish_stereo(
        self, T_tissue_board: Pose, progress: Progress = silent, *, first_is_there: bool = True
    ) -> Outcome[StereoCalibration]:
        """Calibrate the pair; in the first view the board lies at ``T_tissue_board``.

        Parameters
        ----------
        progress : told what is computed, and each step
        first_is_there : False where that view is missing, so that the tissue frame is wherever the board was in the
            first that was taken: what comes out then is to be rejected

        Raises
        ------
        CalibrationError, VisionError
            There are too few views, or they do not determine the lenses.
        """
        size = self._enough()
        report = calibrate(self._pairs, self._board, size, 0, T_tissue_board, progress)
        known_place = (
            () if first_is_there else (Figure("views of the board at its known place", 0.0, "", least=1.0),)
        )
        figures = (
            *self._views_figures(),
            *known_place,
            Figure("pairs of views left out, as they disagree", float(len(report.rejected)), ""),
            Figure("reprojection, rms", report.calibration.rms_px, "px", most=MOST_RMS_PX),
            Figure("largest rms of a view", float(report.pair_rms_px.max()), "px", most=2 * MOST_RMS_PX),
            Figure(HELD_OUT_SCALE, abs(report.held_out_scale), "", most=MOST_SCALE),
            Figure("held-out distances, rms", report.held_out_rms_m, "m", most=MOST_HELD_OUT_M),
            Figure("baseline", report.calibration.baseline_m, "m"),
        )
        rms = report.pair_rms_px[None]
        notes = [
            f"left out: {self._names[number]}, {off_px:.3g} px off what the others agree on"
            for number, off_px in report.rejected.items()
        ]
        return Outcome(
            "stereo", report.calibration, figures, lambda plot: self._draw(plot, rms), tuple(notes)
        )

    def _enough(self) -> tuple[int, int]:
        if self._image_size is None or len(self._pairs) < FEWEST_VIEWS:
            raise CalibrationError(
                f"cameras: {len(self._pairs)} views were taken, {FEWEST_VIEWS} are needed; show the board in the whole "
                "field, near and far, tilted up to 45°"
            )
        return self._image_size

    def _views_figures(self) -> tuple[Figure, ...]:
        left, right = self.coverage
        return (
            Figure("views", float(len(self._pairs)), "", least=float(FEWEST_VIEWS)),
            Figure("left coverage", left, "", least=LEAST_COVERAGE),
            Figure("right coverage", right, "", least=LEAST_COVERAGE),
        )

    def _draw(self, plot: Plot, rms: FloatArray) -> None:
        left, right, views = plot.subplots(1, 3)
        for axes, side in ((left, 0), (right, 1)):
            image = axes.imshow(self.coverage_map(side), cmap="Blues", aspect="auto")
            axes.set(title=f"corners seen, {SIDES[side]}", xticks=[], yticks=[])
            axes.grid(visible=False)
            plot.colorbar(image, ax=axes, shrink=0.6)
        views.plot(rms.T, "o-")
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


def _lens(found: LensCalibration, size: tuple[int, int]) -> Lens:
    fx, fy, cx, cy, k1, k2, p1, p2 = found.intrinsics.tolist()
    a, b, c, d, e, f, g, h = found.intrinsics_std.tolist()
    return Lens(*size, (fx, fy), (cx, cy), (k1, k2, p1, p2, 0.0), found.rms_px, (a, b, c, d, e, f, g, h))


def tilt_deg(lens: LensCalibration) -> float:
    """Return the largest angle between the board's normal and the optical axis, as the board faces the camera."""
    along = np.abs(lens.rotations.as_matrix()[:, 2, 2])
    return math.degrees(math.acos(float(np.clip(along.min(), 0.0, 1.0))))
