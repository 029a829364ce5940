"""Which calibrations are in force for a rig: found, checked against the connected devices, applied and copied.

In force is the newest accepted calibration of each kind that was made of this rig and of the connected devices. What
it found goes before what the rig file says. An expired one stays in force, with a warning; one of other devices does
not, with a warning.
"""

import shutil
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import cast

from daq.calibration_files.outcome import KINDS, Kind
from daq.calibration_files.record import CalibrationRecord, kept, read_record
from daq.calibration_files.results import ForceResult, RobotResult, TimeResult, ToolResult
from daq.rig import Rig, Tool, Transform

_LATENCY_OF = {"force sensor": "force_s", "cameras": "cameras_s"}


@dataclass(frozen=True, slots=True)
class InForce:
    """The calibrations in force, by kind, with the files that they are kept in, and what to warn of."""

    files: Mapping[Kind, Path]
    records: Mapping[Kind, CalibrationRecord]
    warnings: tuple[str, ...]

    def describe(self) -> dict[str, str]:
        """Return a line for each kind: file and date of expiry."""
        return {
            kind: f"{self.files[kind].name}, expires {record.expires}"
            for kind, record in self.records.items()
        }

    def apply(self, rig: Rig) -> Rig:
        """Return the rig with what was found in the place of what its file says."""
        frames = rig.frames
        for kind, record in self.records.items():
            found = record.result
            if kind == "stereo" and len(rig.cameras) > 1:
                rig = replace(rig, stereo_calibration=self.files[kind])
            elif kind == "camera":
                rig = rig.with_only_view_of(self.files[kind])
            elif isinstance(found, RobotResult):
                frames = replace(frames, T_base_tissue=found.T_base_tissue)
            elif isinstance(found, ToolResult):
                turned = frames.T_tool_gripper.quaternion_wxyz
                frames = replace(frames, T_tool_gripper=Transform(found.gripper_in_tool_m, turned))
            elif isinstance(found, ForceResult):
                rig = replace(rig, tool=Tool(found.mass_kg, found.centre_m))
            elif isinstance(found, TimeResult):
                told = {_LATENCY_OF[stream.stream]: stream.latency_s for stream in found.streams}
                rig = replace(rig, latencies=replace(rig.latencies, **told))
        return replace(rig, frames=frames)

    def copy_to(self, folder: Path) -> list[Path]:
        """Copy the files and their plots into an existing folder and return the copies of the files."""
        copies = []
        for path in self.files.values():
            for source in (path, path.with_suffix(".png")):
                if source.exists():
                    shutil.copyfile(source, folder / source.name)
            copies.append(folder / path.name)
        return copies


def calibrations_in_force(rig: Rig, serials: Mapping[str, str], now: datetime | None = None) -> InForce:
    """Find what is in force; nothing where the rig file names no folder of calibrations.

    Parameters
    ----------
    serials : serial number of each connected device by its role
    now : aware; the present if None

    Raises
    ------
    RigError
        A calibration file cannot be read; the message names file and line.
    """
    moment = now or datetime.now(UTC)
    files: dict[Kind, Path] = {}
    records: dict[Kind, CalibrationRecord] = {}
    warnings: list[str] = []
    for kind in _kinds_used(rig):
        for path in reversed(kept(cast(Path, rig.calibration), [kind])):
            record = read_record(path)
            if record.verdict != "accepted" or record.rig != rig.name:
                continue
            if strange := _strange(record, serials):
                warnings.append(f"{path.name} is not in force: {strange}; calibrate {kind} again")
                continue
            if useless := why_unused(kind, rig):
                warnings.append(f"{path.name} is not in force: {useless}")
                break
            if record.expired(moment):
                warnings.append(f"{path.name} expired on {record.expires}; calibrate {kind} again")
            files[kind], records[kind] = path, record
            break
    return InForce(files, records, tuple(warnings))


def why_unused(kind: Kind, rig: Rig) -> str:
    """Return why a calibration that is made of a rig would not be in force; empty if it would."""
    if kind == "camera" and rig.only_view is None:
        return (
            "the rig file has no [planar_view], without which one camera measures no beads; write calibration and "
            "height_std_m under one, or of a depth camera calibration, depth_std_m and at_range_m under [depth_view]"
        )
    return ""


def _kinds_used(rig: Rig) -> list[Kind]:
    """Return the kinds that a rig takes something from: none without a folder, of its cameras those of their number."""
    if rig.calibration is None:
        return []
    of_others: tuple[Kind, ...] = ("camera",) if len(rig.cameras) > 1 else ("cameras", "stereo")
    return [kind for kind in KINDS if kind not in of_others]


def _strange(record: CalibrationRecord, serials: Mapping[str, str]) -> str:
    """Return which device is another one than was calibrated; empty if none is."""
    for told in record.serials:
        present = serials.get(told.role, told.serial)
        if present != told.serial:
            return f"it is of {told.role} {told.serial}, and {present} is connected"
    return ""
