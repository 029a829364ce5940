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

from daq.calibration.by_board import SEEN_BY, calibrate_by_board
from daq.calibration.collected_views import BoardViews, ViewFigures, grey
from daq.calibration.of_rig import require_kind
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
    """Forget what was collected, and begin a kind; lengths of the board are those measured on the print."""

    rig: Rig
    kind: Kind
    board: CharucoBoard


@dataclass(frozen=True, slots=True)
class TakeView:
    """Take images of one moment, one of each camera that is calibrated."""

    images: tuple[NDArray[np.uint8], ...]
    pixel_format: str


@dataclass(frozen=True, slots=True)
class ViewTaken:
    """How the collection stands: its figures, and the corners seen in each cell of each camera's image."""

    figures: ViewFigures
    coverage: tuple[NDArray[np.int64], ...]


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
        self._begun: Begin | None = None
        self._views: BoardViews | None = None
        self._touches: ToolCalibration | None = None
        self._outcome: Outcome[Any] | None = None

    def __call__(self, request: object, progress: Progress = silent) -> object:
        """Answer a request; ``progress`` is told what is computed.

        Raises
        ------
        DaqError
            What was collected does not suffice, or the rig is not calibrated so.
        """
        match request:
            case Begin():
                self._begin(request)
                return request
            case TakeView(images, pixel_format) if self._views is not None:
                figures = self._views.add(*(grey(image, pixel_format) for image in images))
                return ViewTaken(figures, self._views.coverage_maps())
            case TakeTouch(tool) if self._touches is not None:
                return TouchTaken(self._touches.add(tool))
            case Finish() if self._begun is not None:
                return self._judged(self._finished(self._begun, progress))
            case Evaluate(kind, session):
                return self._judged(evaluate(kind, open_recording(session), progress))
            case Keep(folder, rig_name, serials, accepted) if self._outcome is not None:
                path = keep(self._outcome, folder, rig_name, serials, accepted=accepted)
                return Kept(self._outcome.kind, path, accepted)
        raise CalibrationError("nothing was collected yet; begin the calibration first")

    def _begin(self, begun: Begin) -> None:
        self._begun = self._views = self._touches = self._outcome = None
        require_kind(begun.kind, begun.rig)
        if begun.kind in SEEN_BY:
            self._views = BoardViews(begun.board, SEEN_BY[begun.kind])
        elif begun.kind == "tool":
            self._touches = ToolCalibration(flange_tool(begun.rig))
        self._begun = begun

    def _finished(self, begun: Begin, progress: Progress) -> Outcome[Any]:
        if self._views is not None:
            return calibrate_by_board(begun.kind, self._views, begun.rig, progress)
        if self._touches is not None:
            return self._touches.finish()
        raise CalibrationError(f"{begun.kind}: is not made from views or touches; record its motion")

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
