"""The only camera of a rig, from views of a ChArUco board; in the first the board lies on the phantom."""

import numpy as np
from matplotlib.figure import Figure as Plot
from numpy.typing import NDArray

from daq.calibration.cameras import (
    CELLS,
    FEWEST_VIEWS,
    LEAST_COVERAGE,
    LEAST_TILT_DEG,
    MOST_FOCAL_STD,
    MOST_RMS_PX,
    tilt_deg,
)
from daq.calibration_files.outcome import Figure, Outcome
from daq.errors import CalibrationError
from daq.frames import compose, inverse, pose
from daq.progress import Progress, silent
from daq.vision.board_finding import find_out
from daq.vision.calibration.lens import LensCalibration, calibrate_lens, pinhole
from daq.vision.camera_model import PinholeCamera
from daq.vision.charuco import BoardView, CharucoBoard
from daq.vision.errors import VisionError
from robot_drivers.protocols import Pose


class OneCameraCalibration:
    """Collects views of the board; the first one shows it at a known place.

    Parameters
    ----------
    board : as measured on the print
    """

    def __init__(self, board: CharucoBoard) -> None:
        self._board = board
        self._views: list[BoardView] = []
        self._size: tuple[int, int] | None = None

    @property
    def views(self) -> int:
        """How many views were taken."""
        return len(self._views)

    @property
    def coverage(self) -> float:
        """Share of the cells of the image in which a corner has been seen."""
        return float(np.mean(self._counts() > 0))

    def add(self, image: NDArray[np.uint8]) -> str:
        """Take a grey image (height, width), and tell in a line how it stands; "not taken" and why where it is not.

        Raises
        ------
        CalibrationError
            It is of another size than those before.
        """
        size = (image.shape[1], image.shape[0])
        if self._size not in (None, size):
            raise CalibrationError(
                f"camera: a view of {size[0]}x{size[1]} px follows others of {self._size}; take all with one camera"
            )
        note = ""
        try:
            seen = self._board.detect(image)
        except VisionError as error:
            finding = None if self._views else find_out(image, self._board)
            if finding is None or finding.board is None:
                return f"not taken: {error if finding is None else finding.words}"
            self._board, note = finding.board, f"; {finding.words}"
            seen = self._board.detect(image)
        self._views.append(seen)
        self._size = size
        return f"view {self.views}: {len(seen.numbers)} corners, coverage {self.coverage:.0%}{note}"

    def finish(
        self, T_tissue_board: Pose, progress: Progress = silent, *, first_is_there: bool = True
    ) -> Outcome[PinholeCamera]:
        """Calibrate; in the first view the board lies at ``T_tissue_board``.

        Parameters
        ----------
        first_is_there : False where that view is missing: what comes out then is to be rejected

        Raises
        ------
        CalibrationError
            There are too few views.
        """
        if self._size is None or self.views < FEWEST_VIEWS:
            raise CalibrationError(
                f"camera: {self.views} views were taken, {FEWEST_VIEWS} are needed; show the board in the whole field, "
                "near and far, tilted up to 45°"
            )
        lens = calibrate_lens(self._views, self._board.corners, self._size, "only", progress)
        T_cam_board = pose(lens.translations[0], lens.rotations[0])
        camera = pinhole(lens.intrinsics, self._size, compose(T_cam_board, inverse(T_tissue_board)))
        known_place = (
            () if first_is_there else (Figure("views of the board at its known place", 0.0, "", least=1.0),)
        )
        figures = (
            Figure("views", float(self.views), "", least=float(FEWEST_VIEWS)),
            Figure("coverage", self.coverage, "", least=LEAST_COVERAGE),
            Figure("largest tilt", tilt_deg(lens), "°", least=LEAST_TILT_DEG),
            *known_place,
            Figure("reprojection, rms", lens.rms_px, "px", most=MOST_RMS_PX),
            Figure("reprojection of the first view, rms", float(lens.view_rms_px[0]), "px", most=MOST_RMS_PX),
            Figure(
                "focal length, relative deviation",
                float(lens.intrinsics_std[0] / lens.intrinsics[0]),
                "",
                most=MOST_FOCAL_STD,
            ),
            Figure("distance from the phantom", float(np.linalg.norm(camera.centre)), "m"),
        )
        return Outcome("camera", camera, figures, lambda plot: self._draw(plot, lens))

    def _counts(self) -> NDArray[np.int64]:
        counts = np.zeros(CELLS, dtype=np.int64)
        if self._size is not None:
            cells = np.concatenate([view.pixels for view in self._views]) / self._size * (CELLS[1], CELLS[0])
            columns, rows = np.clip(cells.astype(np.intp), 0, (CELLS[1] - 1, CELLS[0] - 1)).T
            np.add.at(counts, (rows, columns), 1)
        return counts

    def _draw(self, plot: Plot, lens: LensCalibration) -> None:
        seen, views = plot.subplots(1, 2)
        image = seen.imshow(self._counts(), cmap="Blues", aspect="auto")
        seen.set(title="corners seen", xticks=[], yticks=[])
        seen.grid(visible=False)
        plot.colorbar(image, ax=seen, shrink=0.6)
        views.plot(lens.view_rms_px, "o-")
        views.set(xlabel="view", ylabel="reprojection, rms px", ylim=(0.0, None))
