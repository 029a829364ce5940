"""Recovering a session: one that was cut off, or whose files were damaged after it was sealed.

Nothing is written before both recordings have been looked through; each damaged file is replaced only by what was read
back and compared (:mod:`daq.recording.sealing.rewriting`).
"""

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from daq.errors import RecordingError
from daq.recording.folder import (
    CALIBRATION_FOLDER,
    CHECKSUMS_FILE,
    FORMAT,
    INFO_FILE,
    RECORDED_FILES,
    RIG_FILE,
    ClockAnchor,
    SessionInfo,
    finish,
    read_info,
    sha256,
    told,
    verify_checksums,
    write_info,
)
from daq.recording.foreign_bags import require_no_foreign_bag
from daq.recording.in_use import require_unused
from daq.recording.layout import CAMERAS_FILE, SIGNALS_FILE
from daq.recording.mcap.log import McapLog
from daq.recording.scanning.scan import scan
from daq.recording.scanning.segments import Damage
from daq.recording.sealing.losses import StreamLoss
from daq.recording.sealing.seal import SealReport, examine, seal
from estimator.errors import InputError
from estimator.input_file import read_input_text, require_file

_KEPT = f"{INFO_FILE}.damaged"
_CUT_OFF = "the recording was cut off and has been recovered"
_DAMAGED = "the recording was damaged and has been recovered"


@dataclass(frozen=True, slots=True)
class Recovery:
    """What recovering a session kept, and what it could not.

    Attributes
    ----------
    info : the new description, whose ``problems`` tell the same in words
    files : the report of each recorded file by its name
    """

    info: SessionInfo
    files: Mapping[str, SealReport]

    @property
    def left_out_bytes(self) -> int:
        """Bytes of the recorded files that could not be used."""
        return sum(report.dropped_bytes for report in self.files.values())

    @property
    def lost(self) -> dict[str, StreamLoss]:
        """Samples by stream that are missing."""
        return {stream: loss for report in self.files.values() for stream, loss in report.lost.items()}


def recover_session(folder: Path) -> Recovery:
    """Save what a session holds that was cut off or damaged, and tell what is lost.

    Raises
    ------
    RecordingError
        There is nothing to recover, it is still being recorded, a file beside the recordings is not what it was, or it
        is no session; nothing was changed.
    """
    require_no_foreign_bag(folder)
    info, described_anew = _description(folder)
    altered = _altered(folder, info) if info.state != "recording" or described_anew else []
    if info.state != "recording" and not altered:
        raise RecordingError(f"{folder}: is {info.state} already; there is nothing to recover")
    _require_beside(folder, info, altered)
    missing = [name for name in RECORDED_FILES if not (folder / name).exists()]
    if len(missing) == len(RECORDED_FILES):
        raise RecordingError(
            f"{folder}: holds neither {SIGNALS_FILE} nor {CAMERAS_FILE}; name a session folder"
        )
    for name in (RIG_FILE, *RECORDED_FILES):
        if (folder / name).exists():
            _require_file(folder / name)
            require_unused(folder / name)
    trusted = info if INFO_FILE not in altered else replace(info, samples={})
    examined = {name: _examined(folder / name, _told(trusted, name)) for name in RECORDED_FILES}
    lines = [_beginning(info, examined), *described_anew, *told(examined)]
    if INFO_FILE in altered and not described_anew:
        lines.append(
            f"{INFO_FILE} differs from what was sealed; compare what it says with the notes of the experiment"
        )
    if CHECKSUMS_FILE in altered:
        lines.append(f"{CHECKSUMS_FILE} was missing or damaged")
    # told before anything is changed, and once where an attempt was interrupted
    before = _content(folder / INFO_FILE)
    if described_anew and before:
        (folder / _KEPT).write_bytes(before)
    noted = replace(info, state="recording", problems=tuple(dict.fromkeys((*info.problems, *lines))))
    write_info(folder, noted)
    counts: list[dict[str, int]] = []
    try:
        for name in RECORDED_FILES:
            counts.append(seal(folder / name).counts)
    except (RecordingError, OSError):
        if not counts:  # nothing has been changed
            _put_back(folder / INFO_FILE, before)
        raise
    reports = {
        name: replace(report, counts=found)
        for (name, report), found in zip(examined.items(), counts, strict=True)
    }
    return Recovery(finish(folder, noted, "recovered", noted.problems, reports), reports)


def _require_file(path: Path) -> None:
    """Refuse a folder, or a pipe that would have to be waited for, in the place of a file."""
    try:
        require_file(path)
    except InputError as error:
        raise RecordingError(str(error)) from error


def _beginning(info: SessionInfo, reports: Mapping[str, SealReport]) -> str:
    left_out = sum(report.dropped_bytes for report in reports.values())
    was_damaged = info.state != "recording" or any(line.startswith(_DAMAGED) for line in info.problems)
    return f"{_DAMAGED if was_damaged else _CUT_OFF}; {left_out} bytes could not be used"


def _examined(path: Path, before: Mapping[str, int]) -> SealReport:
    """Look through a file, and create one without a message where it is missing."""
    missing = not path.exists()
    if missing:
        McapLog(path).close()
    report = examine(path, before)
    return replace(report, damages=(Damage(0, 0, "the file was missing"),)) if missing else report


def _content(path: Path) -> bytes | None:
    return path.read_bytes() if path.is_file() else None


def _put_back(path: Path, content: bytes | None) -> None:
    if content is None:
        path.unlink(missing_ok=True)
    else:
        path.write_bytes(content)


def _told(info: SessionInfo, name: str) -> dict[str, int]:
    """Return the messages of each topic that a session tells to be in one of its files."""
    return {
        topic: count
        for topic, count in info.samples.items()
        if topic.startswith("/camera/") == (name == CAMERAS_FILE)
    }


def _altered(folder: Path, info: SessionInfo) -> list[str]:
    """Return the names of files that differ from what was sealed; with the list itself where that cannot be read."""
    try:
        altered = verify_checksums(folder)
    except RecordingError:
        return [CHECKSUMS_FILE]
    listed = [name for name in altered if name in RECORDED_FILES or name == INFO_FILE or _is_beside(name)]
    # a line of the list that names no file of a session is a damaged line
    return listed + ([CHECKSUMS_FILE] if len(listed) < len(altered) else [])


def _is_beside(name: str) -> bool:
    return name == RIG_FILE or name.startswith(f"{CALIBRATION_FOLDER}/")


def _require_beside(folder: Path, info: SessionInfo, altered: list[str]) -> None:
    """Refuse a session whose rig or calibration is not what it was recorded with: its data would be misread."""
    wrong = {name for name in altered if _is_beside(name)}
    for name, checksum in info.checksums.items():
        path = folder / name
        inside = ".." not in Path(name).parts and path.is_relative_to(folder)
        if inside and _is_beside(name):
            (wrong.discard if path.is_file() and sha256(path) == checksum else wrong.add)(name)
    if wrong:
        raise RecordingError(
            f"{folder}: {', '.join(sorted(wrong))} differ from their checksums; restore them, or "
            f"{INFO_FILE}, from a copy and recover again; nothing was changed"
        )


def _description(folder: Path) -> tuple[SessionInfo, list[str]]:
    """Return the description of a session, and what to tell of one that had to be made anew."""
    try:
        return read_info(folder), []
    except RecordingError as error:
        if (
            not (folder / SIGNALS_FILE).is_file()
            or (folder / INFO_FILE).is_dir()
            or _is_of_other_version(folder)
        ):
            raise
        reason = str(error).partition("; ")[0].removeprefix(f"{folder / INFO_FILE}: ")
    phantom = _phantom(folder)
    info = SessionInfo(folder.resolve().name, phantom, 0, clock_anchor=_anchor(folder))
    line = (
        f"{INFO_FILE} could not be read ({reason}) and was written anew: operator, notes, trajectory, devices and "
        f"calibrations are not known, and the wall clock is that of the file's last change; {_KEPT} is what was there"
    )
    return info, [line]


def _is_of_other_version(folder: Path) -> bool:
    """Tell whether a description says that another version of this software wrote it, which is no damage."""
    found = re.search(rb'"format": "(retraction-session/\d+)"', _content(folder / INFO_FILE) or b"")
    return found is not None and found[1].decode() != FORMAT


def _phantom(folder: Path) -> str:
    """Return the phantom that the copy of the rig file names."""
    try:
        named = tomllib.loads(read_input_text(folder / RIG_FILE))["specimen"]["phantom_id"]
    except (InputError, ValueError, KeyError, TypeError, RecursionError):
        return "unknown"
    return named if isinstance(named, str) else "unknown"


def _anchor(folder: Path) -> ClockAnchor:
    """Estimate which wall time a stamp belongs to: the last one to the last change of the file."""
    path = folder / SIGNALS_FILE
    wall_time_ns = path.stat().st_mtime_ns
    with scan(path) as found:
        last = max((int(each.max()) for one in found.segments for each in one.log_times.values()), default=0)
    return ClockAnchor(min(max(last, 0), 2**63 - 1), max(wall_time_ns, 0))
