"""The session folder: who recorded what with which devices, beside the recorded files.

<session>/
  session.json        this module
  rig.toml            copy of the rig file
  signals.mcap        force, robot, events
  cameras.mcap        images
  calibration/        copies of the calibration files in force
  derived/            what can be computed anew, and may be deleted
  CHECKSUMS.sha256    of all of them but derived/, written at sealing
"""

import hashlib
import json
import os
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal, get_args

from mcap.writer import MCAP0_MAGIC

from daq.errors import RecordingError
from daq.recording.foreign_bags import require_no_foreign_bag
from daq.recording.layout import CAMERAS_FILE, SIGNALS_FILE
from daq.recording.sealing.seal import SealReport, seal
from daq.recording.sync_names import sync_names
from estimator.errors import InputError
from estimator.input_file import parse_json, read_input_text
from robot_drivers.clock import host_time_ns
from robot_drivers.protocols import DeviceIdentity

FORMAT = "retraction-session/1"
INFO_FILE = "session.json"
RIG_FILE = "rig.toml"
_MOST_BYTES_BESIDE = 500_000_000
_MOST_TOLD = 4
RECORDED_FILES = (SIGNALS_FILE, CAMERAS_FILE)
CALIBRATION_FOLDER = "calibration"
CHECKSUMS_FILE = "CHECKSUMS.sha256"
DERIVED_FOLDER = "derived"

State = Literal["recording", "sealed", "recovered"]


@dataclass(frozen=True, slots=True)
class ClockAnchor:
    """One instant on both clocks of the host, ns: its monotonic clock and the wall clock (Unix time)."""

    host_time_ns: int
    wall_time_ns: int

    @classmethod
    def now(cls) -> "ClockAnchor":
        """Read both clocks."""
        return cls(host_time_ns(), time.time_ns())

    @property
    def iso(self) -> str:
        """The wall clock as ISO 8601, UTC."""
        return datetime.fromtimestamp(self.wall_time_ns * 1e-9, UTC).isoformat(timespec="milliseconds")


@dataclass(frozen=True, slots=True)
class SessionInfo:
    """What ``session.json`` says.

    Attributes
    ----------
    name, operator, notes : free text
    phantom_id, order : of the experiment on its mounting
    trajectory : its kind and parameters
    calibrations : file and expiry of each calibration in force, by its kind; copies are in the folder
    devices : identity of each device by its role
    checksums : SHA-256 of rig and calibration files, by their name in the folder
    clock_anchor : taken before recording began
    versions : of Python and the packages
    state : ``recording`` until sealed; a folder that stays so was cut off
    problems : what an analyst must know, such as dropped samples; empty for a flawless session
    samples : recorded messages by topic, known once sealed
    """

    name: str
    phantom_id: str
    order: int
    operator: str = ""
    notes: str = ""
    trajectory: dict[str, Any] = field(default_factory=dict)
    calibrations: dict[str, str] = field(default_factory=dict)
    devices: dict[str, DeviceIdentity] = field(default_factory=dict)
    checksums: dict[str, str] = field(default_factory=dict)
    clock_anchor: ClockAnchor = field(default_factory=ClockAnchor.now)
    versions: dict[str, str] = field(default_factory=dict)
    state: State = "recording"
    problems: tuple[str, ...] = ()
    samples: dict[str, int] = field(default_factory=dict)


def write_info(folder: Path, info: SessionInfo) -> None:
    """Write ``session.json`` in one step: a reader sees the old one or the new one."""
    draft = folder / f"{INFO_FILE}.new"
    with draft.open("wb") as file:
        file.write(_encoded(info))
        file.flush()
        os.fsync(file.fileno())
    draft.replace(folder / INFO_FILE)
    sync_names(folder)


def _encoded(info: SessionInfo) -> bytes:
    text = json.dumps({"format": FORMAT, "started": info.clock_anchor.iso, **asdict(info)}, indent=2)
    return f"{text}\n".encode()


def read_info(folder: Path) -> SessionInfo:
    """Read ``session.json``; raises RecordingError where there is none or it is of another format."""
    require_no_foreign_bag(folder)
    path = folder / INFO_FILE
    try:
        content = parse_json(read_input_text(path), path)
        if content.pop("format") != FORMAT:
            raise RecordingError(f"{path}: is not of the format {FORMAT}; {_advice(folder)}")
        content.pop("started")
        devices = {role: DeviceIdentity(**told) for role, told in content.pop("devices").items()}
        anchor = ClockAnchor(**content.pop("clock_anchor"))
        problems = tuple(content.pop("problems"))
        info = SessionInfo(devices=devices, clock_anchor=anchor, problems=problems, **content)
        _check_types(info)
        return info
    except InputError as error:
        raise RecordingError(f"{error}; {_advice(folder)}") from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise RecordingError(f"{path}: is no session description ({error!r}); {_advice(folder)}") from error


def _advice(folder: Path) -> str:
    """Return what helps where a description cannot be read."""
    if (folder / SIGNALS_FILE).is_file():
        return f"restore it from a copy, or run `retract recover {folder}`, which writes what is known of it anew"
    return "name a session folder"


def _check_types(info: SessionInfo) -> None:
    """Raise TypeError where something is of another type than its field says."""
    anchor, devices = info.clock_anchor, info.devices.values()
    texts = [info.name, info.phantom_id, info.operator, info.notes, *info.problems]
    texts += [text for one in devices for text in (one.kind, one.model, one.serial, one.address)]
    tables = [info.calibrations, info.checksums, info.versions, *(one.details for one in devices)]
    counts = [info.order, anchor.host_time_ns, anchor.wall_time_ns, *info.samples.values()]
    if not all(
        isinstance(text, str) for text in (*texts, *(text for table in tables for text in table.values()))
    ):
        raise TypeError("a text is none")
    if not all(type(count) is int and 0 <= count < 2**63 for count in counts):
        raise TypeError("a whole number is none")
    if not isinstance(info.trajectory, dict) or info.state not in get_args(State):
        raise TypeError("trajectory or state cannot be right")


def _as_sealed(path: Path) -> bool:
    """Tell by a look whether a file may be what was sealed; only then all of it need be read.

    A recording ends with the mark of its format, and has no limit in size; no other file of a session is large.
    """
    if path.name not in RECORDED_FILES:
        return path.stat().st_size <= _MOST_BYTES_BESIDE
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - len(MCAP0_MAGIC)))
        return file.read() == MCAP0_MAGIC


def seal_session(folder: Path, problems: tuple[str, ...] = ()) -> SessionInfo:
    """Seal the files of a session, write its checksums and its final description."""
    reports = {name: seal(folder / name) for name in RECORDED_FILES}
    found = told(reports)
    return finish(folder, read_info(folder), "sealed", (*problems, *found), reports)


def told(reports: Mapping[str, SealReport]) -> list[str]:
    """Return what was found damaged in the files of a session, a line for each of them."""
    return [f"{name}: {line}" for name, report in reports.items() if (line := _damage_line(report))]


def _damage_line(report: SealReport) -> str:
    parts = []
    if report.damages:
        places = "; ".join(one.what for one in report.damages[:_MOST_TOLD])
        more = f" and {len(report.damages) - _MOST_TOLD} more" if len(report.damages) > _MOST_TOLD else ""
        parts.append(f"{report.dropped_bytes} bytes could not be used ({places}{more})")
    lost = [f"{stream} {loss}" for stream, loss in report.lost.items() if loss.samples]
    if lost:
        parts.append(f"samples lost: {', '.join(lost)}")
    parts += report.notes[:_MOST_TOLD]
    if report.unchecked:
        parts.append(f"{report.unchecked} messages have no checksum and were not checked")
    return "; ".join(parts)


def finish(
    folder: Path,
    known: SessionInfo,
    state: State,
    problems: tuple[str, ...],
    reports: Mapping[str, SealReport],
) -> SessionInfo:
    """Write the checksums and the final description, this last: until then the session can be recovered.

    Checksums of a long session take a minute, so what is known of it is written before.
    """
    counts = {topic: count for report in reports.values() for topic, count in report.counts.items()}
    info = replace(known, state="recording", problems=problems, samples=counts)
    write_info(folder, info)
    final = replace(info, state=state)
    kept = [path for path in folder.rglob("*") if path.is_file() and path.name != CHECKSUMS_FILE]
    files = sorted(path for path in kept if path.relative_to(folder).parts[0] != DERIVED_FOLDER)
    sums = {path.relative_to(folder).as_posix(): sha256(path) for path in files}
    sums[INFO_FILE] = hashlib.sha256(_encoded(final)).hexdigest()
    lines = [f"{checksum}  {name}\n" for name, checksum in sums.items()]
    (folder / CHECKSUMS_FILE).write_text("".join(lines), encoding="utf-8")
    write_info(folder, final)
    return final


def verify_checksums(folder: Path) -> list[str]:
    """Return the names of the files that are missing or differ from ``CHECKSUMS.sha256``.

    Raises
    ------
    RecordingError
        That file cannot be read.
    """
    try:
        text = read_input_text(folder / CHECKSUMS_FILE)
    except InputError as error:
        raise RecordingError(
            f"{error}; `retract recover {folder}` checks the recording and writes it anew"
        ) from error
    differing = []
    lines = text.splitlines()
    listed = {line.partition("  ")[2] for line in lines}
    beside = [folder / RIG_FILE, *(folder / CALIBRATION_FOLDER).glob("*")]
    needed = {path.relative_to(folder).as_posix() for path in beside if path.exists()}
    if not text.endswith("\n") or not listed >= {INFO_FILE, *RECORDED_FILES, *needed}:
        differing.append(CHECKSUMS_FILE)
    for line in lines:
        expected, _, name = line.partition("  ")
        path = folder / name
        inside = ".." not in path.parts and path.is_relative_to(folder)
        if not inside or not path.is_file() or not _as_sealed(path) or sha256(path) != expected:
            differing.append(name)
    return differing


def sha256(path: Path) -> str:
    """Return the SHA-256 of a file, hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
