"""What a crate says of a session: devices, software, phantom, calibrations and files as entities of schema.org.

Reference: RO-Crate Metadata Specification 1.2, sections "Provenance of entities" and "Data Entities".
"""

from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from urllib.parse import quote

from daq.calibration_files.record import read_record
from daq.errors import RigError
from daq.export.ro_crate.publication import slug
from daq.recording.folder import CALIBRATION_FOLDER, CHECKSUMS_FILE, INFO_FILE, RIG_FILE, SessionInfo, sha256
from daq.recording.layout import CAMERAS_FILE, SIGNALS_FILE
from robot_drivers.protocols import DeviceIdentity

Entity = dict[str, Any]

MCAP = "https://mcap.dev/spec"
SOFTWARE = "#software"
_FORMATS = {
    ".toml": "application/toml",
    ".json": "application/json",
    ".csv": "text/csv",
    ".stl": "model/stl",
    ".png": "image/png",
    ".sha256": "text/plain",
}
_SAYS = {
    INFO_FILE: "what was recorded: devices, trajectory, versions, problems, one instant on both clocks",
    RIG_FILE: "the rig: devices, frames, tool, limits, phantom",
    SIGNALS_FILE: "force, pose, joints and events as the devices delivered them, stamped by the host's clock",
    CAMERAS_FILE: "images of the cameras without loss, and their intrinsics",
    CHECKSUMS_FILE: "SHA-256 of every file as it was sealed",
}


def reference(entity: Entity) -> Entity:
    """Return what refers to an entity."""
    return {"@id": entity["@id"]}


def device(role: str, identity: DeviceIdentity) -> Entity:
    """Return a device by its role in the rig."""
    details = {"kind": identity.kind, "address": identity.address, **identity.details}
    found: Entity = {
        "@id": f"#device-{slug(role)}",
        "@type": "IndividualProduct",
        "name": f"{role}: {identity.model or identity.kind}",
        "model": identity.model or "not told",
        "serialNumber": identity.serial or "not told",
    }
    told = "; ".join(f"{name} {value}" for name, value in details.items() if value)
    return found | ({"description": told} if told else {})


def software(versions: Mapping[str, str]) -> Entity:
    """Return the software with the versions of what it depends on."""
    others = [f"{name} {version}" for name, version in versions.items() if name != "retraction"]
    return {
        "@id": SOFTWARE,
        "@type": "SoftwareApplication",
        "name": "retraction",
        "description": "records, synchronises and analyses the retraction of soft tissue",
        "version": versions.get("retraction", "not told"),
        "softwareRequirements": ", ".join(others),
    }


def phantom(info: SessionInfo, words: str) -> Entity:
    """Return what was retracted."""
    name = info.phantom_id or "phantom"
    return {"@id": f"#phantom-{slug(name)}", "@type": "Thing", "name": name, "description": words}


def calibration(file: Path, entity: Entity) -> Entity:
    """Return the entity of a calibration file, with when it was made, until when it holds, and its verdict."""
    try:
        record = read_record(file)
    except RigError:
        return entity | {"description": "calibration of the stereo pair"}
    figures = "; ".join(figure.describe() for figure in record.figures)
    serials = ", ".join(f"{one.role} {one.serial}" for one in record.serials)
    return entity | {
        "name": f"calibration of {record.kind}",
        "description": f"{record.verdict}; of {serials or 'the rig'}; {figures}",
        "dateCreated": record.date,
        "expires": record.expires,
    }


def file_entity(file: Path, crate: Path) -> Entity:
    """Return the entity of a file of a crate, with size, format and checksum."""
    place = file.relative_to(crate).as_posix()
    found: Entity = {
        "@id": quote(place, safe="/"),
        "@type": "File",
        "name": place,
        "contentSize": str(file.stat().st_size),
        "encodingFormat": _FORMATS.get(file.suffix, "application/octet-stream"),
        "sha256": sha256(file),
    }
    if file.suffix == ".mcap":
        found["encodingFormat"] = ["application/octet-stream", {"@id": MCAP}]
    if file.name in _SAYS:
        found["description"] = _SAYS[file.name]
    is_calibration = file.parent.name == CALIBRATION_FOLDER and file.suffix == ".toml"
    return calibration(file, found) if is_calibration else found


def mcap_format() -> Entity:
    """Return the entity of the format of recordings."""
    return {"@id": MCAP, "@type": "WebPage", "name": "MCAP file format specification"}


def iso(time_ns: int) -> str:
    """Return an instant of unix time as ISO 8601, UTC."""
    return datetime.fromtimestamp(time_ns * 1e-9, UTC).isoformat(timespec="milliseconds")
