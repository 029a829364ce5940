"""Keeping an outcome as a calibration file with its plot, once somebody or its figures have judged it."""

from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Plot

from daq.calibration_files.outcome import Kind, Outcome
from daq.calibration_files.record import FORMAT, CalibrationRecord, Serial
from daq.errors import CalibrationError
from daq.files.atomic import replace_text
from daq.files.toml_tables import toml_text

VALIDITY: Mapping[Kind, timedelta] = {
    "camera": timedelta(days=90),
    "cameras": timedelta(days=365),
    "stereo": timedelta(days=90),
    "robot": timedelta(days=90),
    "force": timedelta(days=30),
    "time": timedelta(days=180),
    "tool": timedelta(days=90),
}
"""How long a calibration of each kind holds."""

_DPI = 110


def keep(
    outcome: Outcome[Any],
    folder: Path,
    rig: str,
    serials: Mapping[str, str],
    *,
    accepted: bool,
    now: datetime | None = None,
) -> Path:
    """Write a calibration and its plot, and return the file.

    Parameters
    ----------
    folder : made if it does not exist
    rig : name of the rig
    serials : serial number of each device that it is of, by role
    accepted : the verdict; figures that are not as they have to be cannot be accepted
    now : aware; the present if None

    Raises
    ------
    CalibrationError
        It is to be accepted although a figure forbids it.
    """
    if accepted and not outcome.acceptable:
        missed = next(figure for figure in outcome.figures if not figure.passed)
        raise CalibrationError(f"{outcome.kind}: cannot be accepted, {missed.describe()}; calibrate again")
    made = now or datetime.now(UTC)
    record = CalibrationRecord(
        format=FORMAT,
        kind=outcome.kind,
        rig=rig,
        date=made.isoformat(timespec="seconds"),
        expires=(made + VALIDITY[outcome.kind]).isoformat(timespec="seconds"),
        verdict="accepted" if accepted else "rejected",
        serials=tuple(Serial(role, serial) for role, serial in serials.items()),
        figures=outcome.figures,
        result=outcome.result,
    )
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{outcome.kind}_{made:%Y-%m-%d_%H%M%S}.toml"
    _draw(outcome, path.with_suffix(".png"))
    replace_text(path, toml_text(record, folder))
    return path


def _draw(outcome: Outcome[Any], path: Path) -> None:
    with rc_context({"font.size": 9, "axes.grid": True, "grid.alpha": 0.4}):
        plot = Plot(figsize=(7.2, 4.0), dpi=_DPI, layout="constrained")
        FigureCanvasAgg(plot)
        outcome.draw(plot)
        plot.savefig(path)
