"""Writing a crate: the session as it was sealed, the experiment where there is one, and ``ro-crate-metadata.json``.

Reference: RO-Crate Metadata Specification 1.2, https://w3id.org/ro/crate/1.2.
"""

import json
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from daq.errors import RigError
from daq.export.ro_crate.entities import (
    SOFTWARE,
    Entity,
    device,
    file_entity,
    iso,
    mcap_format,
    phantom,
    reference,
    software,
)
from daq.export.ro_crate.publication import Publication, licence, person, slug
from daq.progress import Progress
from daq.recording.folder import DERIVED_FOLDER, RIG_FILE
from daq.recording.reader import Recording
from daq.rig import read_rig
from daq.versions import package_versions

METADATA = "ro-crate-metadata.json"
SESSION, EXPERIMENT = "session", "experiment"
_SPECIFICATION = "https://w3id.org/ro/crate/1.2"
_COMPLETED = {"@id": "http://schema.org/CompletedActionStatus"}
_MEASURED = (
    ("force of the tissue on the gripper", "N"),
    ("torque about the gripper's origin", "N m"),
    ("place of the gripper", "m"),
    ("places of the beads", "m"),
)


@dataclass(frozen=True, slots=True)
class RoCrate:
    """What was written: files, entities of the description, and why there is no experiment; empty where there is."""

    files: int
    entities: int
    unsynchronised: str


def write_ro_crate(
    recording: Recording, folder: Path, unsynchronised: str, publication: Publication, progress: Progress
) -> RoCrate:
    """Make a crate of a folder that may hold the session's experiment already, and put the session beside it.

    Parameters
    ----------
    unsynchronised : why there is no experiment; empty where there is one
    """
    progress("copying the session", 0, 2)
    shutil.copytree(recording.folder, folder / SESSION, ignore=shutil.ignore_patterns(DERIVED_FOLDER))
    progress("describing the files", 1, 2)
    session_files, experiment_files = (_files(folder / name, folder) for name in (SESSION, EXPERIMENT))
    graph = _graph(recording, (session_files, experiment_files), publication)
    text = json.dumps(
        {"@context": f"{_SPECIFICATION}/context", "@graph": graph}, indent=2, ensure_ascii=False
    )
    (folder / METADATA).write_text(text + "\n", encoding="utf-8")
    return RoCrate(len(session_files) + len(experiment_files), len(graph), unsynchronised)


def _files(part: Path, crate: Path) -> list[Entity]:
    found = sorted(file for file in part.rglob("*") if file.is_file()) if part.is_dir() else []
    return [file_entity(file, crate) for file in found]


def _graph(
    recording: Recording, files: tuple[list[Entity], list[Entity]], publication: Publication
) -> list[Entity]:
    """Return all entities, the description of the description first."""
    info = recording.info
    people = [person(name) for name in publication.authors or ((info.operator,) if info.operator else ())]
    operator = person(info.operator) if info.operator else None
    devices = [device(role, identity) for role, identity in info.devices.items()]
    versions = info.versions or package_versions()
    tissue = phantom(info, _phantom_words(recording))
    measured = [_measured(name, unit) for name, unit in _MEASURED]
    folders = [
        _part(name, entities) for name, entities in zip((SESSION, EXPERIMENT), files, strict=True) if entities
    ]
    actions = _actions(recording, files, devices, (operator, tissue))
    terms, licence_entity = licence(publication.licence)
    root: Entity = {
        "@id": "./",
        "@type": "Dataset",
        "name": f"{info.name}: retraction of {tissue['name']}, {info.clock_anchor.iso[:10]}",
        "description": _description(recording),
        "datePublished": datetime.now(UTC).date().isoformat(),
        "dateCreated": info.clock_anchor.iso,
        "license": terms,
        "author": [reference(one) for one in people],
        "about": reference(tissue),
        "keywords": "soft tissue, robotics, retraction, force, stereo vision",
        "variableMeasured": [reference(one) for one in measured],
        "mentions": [reference(one) for one in actions],
        "hasPart": [reference(one) for one in folders],
    }
    descriptor: Entity = {
        "@id": METADATA,
        "@type": "CreativeWork",
        "about": {"@id": "./"},
        "conformsTo": {"@id": _SPECIFICATION},
    }
    described = [*people, *([operator] if operator else []), *devices, software(versions), tissue, *measured]
    beside = [mcap_format(), *([licence_entity] if licence_entity else [])]
    found = [descriptor, root, *folders, *files[0], *files[1], *actions, *described, *beside]
    return list(
        {entity["@id"]: {key: value for key, value in entity.items() if value} for entity in found}.values()
    )


def _actions(
    recording: Recording,
    files: tuple[list[Entity], list[Entity]],
    devices: Sequence[Entity],
    operator_and_tissue: tuple[Entity | None, Entity],
) -> list[Entity]:
    """Return how the files came to be: the recording, and the experiment that was made of it."""
    operator, tissue = operator_and_tissue
    info = recording.info
    trajectory = ", ".join(f"{name} {value}" for name, value in info.trajectory.items())
    recorded: Entity = {
        "@id": "#recording",
        "@type": "CreateAction",
        "name": f"recording of {info.name}",
        "description": f"trajectory: {trajectory}" if trajectory else "",
        "startTime": info.clock_anchor.iso,
        "endTime": _end(recording),
        "instrument": [*(reference(one) for one in devices), {"@id": SOFTWARE}],
        "object": reference(tissue),
        "result": [reference(one) for one in files[0]],
        "actionStatus": _COMPLETED,
    }
    if operator is not None:
        recorded["agent"] = reference(operator)
    if not files[1]:
        return [recorded]
    made: Entity = {
        "@id": "#synchronisation",
        "@type": "CreateAction",
        "name": "synchronisation",
        "description": "every row is the mean over a measuring window, all streams on one clock, in the tissue frame",
        "endTime": datetime.now(UTC).isoformat(timespec="seconds"),
        "instrument": {"@id": SOFTWARE},
        "object": [reference(one) for one in files[0]],
        "result": [reference(one) for one in files[1]],
        "actionStatus": _COMPLETED,
    }
    return [recorded, made]


def _part(name: str, files: Sequence[Entity]) -> Entity:
    words = {
        SESSION: "the recording as it was sealed, with rig and calibrations",
        EXPERIMENT: "the recording synchronised: wrench, pose and beads in the tissue frame, SI units",
    }
    parts = [reference(one) for one in files]
    return {"@id": f"{name}/", "@type": "Dataset", "name": name, "description": words[name], "hasPart": parts}


def _measured(name: str, unit: str) -> Entity:
    return {"@id": f"#{slug(name)}", "@type": "PropertyValue", "name": name, "unitText": unit}


def _description(recording: Recording) -> str:
    info = recording.info
    streams = ", ".join(f"{count} messages of {topic}" for topic, count in info.samples.items() if count)
    parts = [
        f"A robot retracts soft tissue and records it ({streams})." if streams else "A recorded retraction.",
        info.notes,
        f"What an analyst must know: {'; '.join(info.problems)}." if info.problems else "",
    ]
    return " ".join(part for part in parts if part)


def _phantom_words(recording: Recording) -> str:
    try:
        body = read_rig(recording.folder / RIG_FILE, to_connect=False).specimen.phantom
    except RigError:
        return "the tissue that was retracted"
    size = " x ".join(f"{1e3 * edge:.1f}" for edge in body.size_m)
    return f"{body.shape} of {size} mm"


def _end(recording: Recording) -> str:
    """Return when the last sample of force or robot was received."""
    anchor = recording.info.clock_anchor
    last = [int(one.host_time_ns[-1]) for one in (recording.force, recording.robot) if len(one)]
    return iso(max(last) - anchor.host_time_ns + anchor.wall_time_ns) if last else anchor.iso
