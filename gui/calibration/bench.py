"""Calibrations beside the window: views and touches are collected here, outcomes judged, drawn and kept.

One :class:`CalibrationBench` lives in a process of its own (:mod:`gui.jobs.companion`); the requests and answers are
below.
"""

import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Plot
from numpy.typing import NDArray

from daq.calibration.cameras import BoardCalibration, ViewFigures, grey, lying_on_phantom
from daq.calibration.procedures import evaluate
from daq.calibration.tool import PivotFigures, ToolCalibration, flange_tool
from daq.calibration_files.keeping import keep
from daq.calibration_files.outcome import Figure, Kind, Outcome
from daq.errors import CalibrationError
from daq.progress import Progress, silent
from daq.recording.reader import open_recording
from daq.rig import Rig
from daq.vision.charuco import CharucoBoard
from robot_drivers.protocols import Pose

_DPI = 110


@dataclass(frozen=True, slots=True)
class Begin:
    """Forget what was collected; lengths of the board are those measured on the print."""

    rig: Rig
    board: CharucoBoard


@dataclass(frozen=True, slots=True)
class TakeView:
    """Take both cameras' images of one moment."""

    images: tuple[NDArray[np.uint8], NDArray[np.uint8]]
    pixel_format: str


@dataclass(frozen=True, slots=True)
class ViewTaken:
    """How the collection stands: its figures, and the corners seen in each cell of the left and the right image."""

    figures: ViewFigures
    coverage: tuple[NDArray[np.int64], NDArray[np.int64]]


@dataclass(frozen=True, slots=True)
class TakeTouch:
    """Take ``T_base_tool`` for a touch of the fixed point."""

    T_base_tool: Pose


@dataclass(frozen=True, slots=True)
class TouchTaken:
    """How the collection stands."""

    figures: PivotFigures


@dataclass(frozen=True, slots=True)
class Finish:
    """Calibrate from what was collected."""

    kind: Kind


@dataclass(frozen=True, slots=True)
class Evaluate:
    """Calibrate from a recorded motion."""

    kind: Kind
    session: Path


@dataclass(frozen=True, slots=True)
class Judged:
    """An outcome that waits for its verdict: the figures for and against it, its plot as PNG, and further notes."""

    kind: Kind
    figures: tuple[Figure, ...]
    acceptable: bool
    plot: bytes
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Keep:
    """Keep the last outcome with a verdict; ``serials`` by role."""

    folder: Path
    rig_name: str
    serials: Mapping[str, str]
    accepted: bool


@dataclass(frozen=True, slots=True)
class Kept:
    """Where an outcome was kept, and with which verdict."""

    kind: Kind
    path: Path
    accepted: bool


class CalibrationBench:
    """Answers the requests above; an outcome stays here until it is kept or another one is made."""

    def __init__(self) -> None:
        self._rig: Rig | None = None
        self._board = CharucoBoard()
        self._views = BoardCalibration(self._board)
        self._touches: ToolCalibration | None = None
        self._outcome: Outcome[Any] | None = None

    def __call__(self, request: object, progress: Progress = silent) -> object:
        """Answer a request; ``progress`` is told what is computed.

        Raises
        ------
        DaqError
            What was collected does not suffice.
        """
        match request:
            case Begin(rig, board):
                self._rig, self._board, self._outcome = rig, board, None
                self._views, self._touches = BoardCalibration(board), ToolCalibration(flange_tool(rig))
                return request
            case TakeView(images, pixel_format):
                left, right = (grey(image, pixel_format) for image in images)
                figures = self._views.add(left, right)
                return ViewTaken(figures, (self._views.coverage_map(0), self._views.coverage_map(1)))
            case TakeTouch(tool) if self._touches is not None:
                return TouchTaken(self._touches.add(tool))
            case Finish(kind):
                return self._judged(self._finished(kind, progress))
            case Evaluate(kind, session):
                return self._judged(evaluate(kind, open_recording(session), progress))
            case Keep(folder, rig_name, serials, accepted) if self._outcome is not None:
                path = keep(self._outcome, folder, rig_name, serials, accepted=accepted)
                return Kept(self._outcome.kind, path, accepted)
        raise CalibrationError("nothing was collected yet; begin the calibration first")

    def _finished(self, kind: Kind, progress: Progress) -> Outcome[Any]:
        if self._rig is None or self._touches is None:
            raise CalibrationError(f"{kind}: nothing was collected yet; begin the calibration first")
        if kind == "cameras":
            return self._views.finish_cameras(progress)
        if kind == "stereo":
            return self._views.finish_stereo(lying_on_phantom(self._board, self._rig), progress)
        return self._touches.finish()

    def _judged(self, outcome: Outcome[Any]) -> Judged:
        self._outcome = outcome
        return Judged(outcome.kind, outcome.figures, outcome.acceptable, _drawn(outcome), outcome.notes)


def _drawn(outcome: Outcome[Any]) -> bytes:
    with rc_context({"font.size": 9, "axes.grid": True, "grid.alpha": 0.4}):
        plot = Plot(figsize=(7.2, 3.6), dpi=_DPI, layout="constrained")
        FigureCanvasAgg(plot)
        outcome.draw(plot)
        png = io.BytesIO()
        plot.savefig(png, format="png")
    return png.getvalue()
