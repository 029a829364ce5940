"""Calibration files: ``<kind>_<date>.toml`` with a plot of the same name beside it.

A file tells of which rig and which devices it is, when it was made and until when it holds, what was found, by which
figures it was judged, and the verdict. A rejected calibration is kept as well; it is never in force.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Literal

from daq.calibration_files.outcome import Figure, Kind
from daq.calibration_files.results import RESULTS
from daq.files.toml_tables import TomlFile

FORMAT = "retraction-calibration/1"


@dataclass(frozen=True, slots=True)
class Serial:
    """A device by its role in the rig, and its serial number."""

    role: str
    serial: str


@dataclass(frozen=True, slots=True)
class CalibrationRecord:
    """A kept calibration; the type of ``result`` is that of its kind in ``daq.calibration_files.results.RESULTS``."""

    format: str
    kind: Kind
    rig: str
    date: str
    expires: str
    verdict: Literal["accepted", "rejected"]
    serials: tuple[Serial, ...]
    figures: tuple[Figure, ...]
    result: object

    def expired(self, now: datetime) -> bool:
        """Tell whether it has expired."""
        return now > datetime.fromisoformat(self.expires)


def read_record(path: Path) -> CalibrationRecord:
    """Read a calibration file; raises RigError that names file, line and key of what is wrong."""
    file = TomlFile.read(path)
    record = file.build(CalibrationRecord, file.root)
    if record.format != FORMAT:
        raise file.mistake(("format",), f'must be "{FORMAT}", not {record.format!r}')
    for key in ("date", "expires"):
        try:
            moment = datetime.fromisoformat(getattr(record, key))
        except ValueError:
            moment = None
        if moment is None or moment.tzinfo is None:
            raise file.mistake((key,), "must be a date with time and time zone, as 2026-05-04T14:32:10+00:00")
    return replace(record, result=file.build(RESULTS[record.kind], record.result, ("result",)))


def kept(folder: Path, kinds: Sequence[Kind]) -> list[Path]:
    """Return the calibration files of these kinds, oldest first."""
    return sorted(path for kind in kinds for path in folder.glob(f"{kind}_[0-9]*.toml"))
