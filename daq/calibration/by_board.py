"""Calibrations that views of a board make: which there are, who sees the board, and what each computes."""

from collections.abc import Callable, Mapping
from typing import Any

from daq.calibration.cameras import calibrate_cameras, calibrate_stereo
from daq.calibration.collected_views import ONLY, SIDES, BoardViews, lying_on_phantom
from daq.calibration.one_camera import calibrate_camera
from daq.calibration_files.outcome import Kind, Outcome
from daq.errors import CalibrationError
from daq.progress import Progress
from daq.rig import Rig

SEEN_BY: Mapping[Kind, tuple[str, ...]] = {"camera": ONLY, "cameras": SIDES, "stereo": SIDES}
"""Who sees the board, of each kind that is made from views of it."""


def calibrate_by_board(
    kind: Kind, views: BoardViews, rig: Rig, progress: Progress, *, first_is_there: bool = True
) -> Outcome[Any]:
    """Calibrate from views that were collected; in the first of them the board lies on the middle of the phantom.

    Parameters
    ----------
    first_is_there : False where that view is missing: what needs it is to be rejected then

    Raises
    ------
    CalibrationError, VisionError
        There are too few views, or they do not determine what is sought.
    """
    T_tissue_board = lying_on_phantom(views.board, rig)
    calibrations: Mapping[Kind, Callable[[], Outcome[Any]]] = {
        "camera": lambda: calibrate_camera(views, T_tissue_board, progress, first_is_there=first_is_there),
        "cameras": lambda: calibrate_cameras(views, progress),
        "stereo": lambda: calibrate_stereo(views, T_tissue_board, progress, first_is_there=first_is_there),
    }
    if kind not in calibrations or views.sides != SEEN_BY[kind]:
        raise CalibrationError(f"{kind}: is not made from views of a board by {len(views.sides)} cameras")
    return calibrations[kind]()
