"""A session as an RO-Crate, opened by the library of the format."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from rocrate.rocrate import ROCrate
from synthetic_session import SyntheticSession

from daq.cli import main
from daq.export import Publication, export_ro_crate
from daq.export.ro_crate.publication import licence, person
from daq.progress import silent
from daq.recording.folder import read_info, seal_session, sha256, verify_checksums, write_info
from daq.virtual_rig.layout import GRASP_CENTRE, placed_beads
from daq.virtual_rig.physics.phantom import SpringPhantom
from estimator.experiment import read_experiment
from robot_drivers.protocols import DeviceIdentity, Pose

POSES = tuple(Pose((0.04 + way, 0.0, 0.0)) for way in (0.0, 0.003))
ORCID = "0000-0002-1825-0097"


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("crate") / "session"
    SyntheticSession(POSES, SpringPhantom(GRASP_CENTRE, placed_beads(3))).write(folder)
    devices = {
        "force sensor": DeviceIdentity("netft", "Gamma", "FT12345", "192.168.1.1", {"firmware": "1.0"})
    }
    write_info(
        folder, replace(read_info(folder), operator="Grace Hopper", devices=devices, notes="A first try.")
    )
    seal_session(folder)
    return folder


@pytest.fixture(scope="module")
def crate(session: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("crate") / "crate"
    publication = Publication((f"Ada Lovelace <{ORCID}>",), "CC-BY-4.0")
    assert export_ro_crate(session, target, publication, silent).unsynchronised == ""
    return target


def entities(crate: Path) -> dict[str, dict]:
    graph = json.loads((crate / "ro-crate-metadata.json").read_text(encoding="utf-8"))["@graph"]
    return {entity["@id"]: entity for entity in graph}


def test_the_library_of_the_format_finds_who_what_devices_and_licence(crate: Path) -> None:
    found = ROCrate(crate)
    root = found.root_dataset
    assert root.type == "Dataset"
    assert [author["name"] for author in root["author"]] == ["Ada Lovelace"]
    assert root["author"][0].id == f"https://orcid.org/{ORCID}"
    assert root["license"].id == "https://spdx.org/licenses/CC-BY-4.0"
    assert "A first try." in root["description"]
    # the library lists what the parts hold beside them
    assert {part.id for part in root["hasPart"]} > {"session/", "experiment/"}
    recording = found.get("#recording")
    assert recording.type == "CreateAction"
    assert recording["agent"]["name"] == "Grace Hopper"
    sensor = next(one for one in recording["instrument"] if one.type == "IndividualProduct")
    assert (sensor["model"], sensor["serialNumber"]) == ("Gamma", "FT12345")
    assert "firmware 1.0" in sensor["description"]
    assert recording["startTime"] < recording["endTime"]
    assert {one.id for one in recording["result"]} >= {"session/signals.mcap", "session/cameras.mcap"}
    assert found.get("session/calibration/stereo.toml").type == "File"
    assert found.get("#software")["version"]


def test_every_file_is_described_and_is_what_its_checksum_says(crate: Path) -> None:
    told = entities(crate)
    files = {
        file.relative_to(crate).as_posix(): file
        for file in crate.rglob("*")
        if file.is_file() and file.name != "ro-crate-metadata.json"
    }
    assert {name for name, one in told.items() if one["@type"] == "File"} == set(files)
    for name, file in files.items():
        assert told[name]["sha256"] == sha256(file)
        assert told[name]["contentSize"] == str(file.stat().st_size)


def test_the_crate_is_as_its_specification_asks(crate: Path) -> None:
    """MUSTs of RO-Crate 1.2: the descriptor, the root's properties, and that all data hang on the root."""
    content = json.loads((crate / "ro-crate-metadata.json").read_text(encoding="utf-8"))
    assert content["@context"] == "https://w3id.org/ro/crate/1.2/context"
    graph = content["@graph"]
    told = entities(crate)
    assert len(told) == len(graph)  # every identifier once
    descriptor = told["ro-crate-metadata.json"]
    assert descriptor["@type"] == "CreativeWork"
    assert descriptor["about"] == {"@id": "./"}
    assert descriptor["conformsTo"] == {"@id": "https://w3id.org/ro/crate/1.2"}
    assert {"name", "description", "datePublished", "license"} <= told["./"].keys()
    reached, waiting = set(), ["./"]
    while waiting:
        part = waiting.pop()
        reached.add(part)
        waiting += [one["@id"] for one in told[part].get("hasPart", []) if one["@id"] not in reached]
    data = {name for name, one in told.items() if one["@type"] in ("File", "Dataset")}
    assert data == reached
    assert (
        list(
            references(graph)
            - told.keys()
            - {"https://w3id.org/ro/crate/1.2", "http://schema.org/CompletedActionStatus"}
        )
        == []
    )


def references(value: object) -> set[str]:
    """What is referred to, anywhere."""
    if isinstance(value, dict):
        if value.keys() == {"@id"}:
            return {value["@id"]}
        return set().union(*(references(one) for one in value.values()))
    return set().union(*(references(one) for one in value)) if isinstance(value, list) else set()


def test_what_is_in_the_crate_is_a_session_and_an_experiment(crate: Path) -> None:
    assert verify_checksums(crate / "session") == []
    assert len(read_experiment(crate / "experiment").time) == len(POSES)


def test_without_licence_and_author_the_crate_says_so(
    session: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    call = ["export", str(session), "--format", "ro-crate", "--output", str(tmp_path / "crate")]
    assert main(call) == 0
    assert "no licence is stated" in capsys.readouterr().out
    root = ROCrate(tmp_path / "crate").root_dataset
    assert root["license"].startswith("No licence was stated")
    assert [author["name"] for author in root["author"]] == ["Grace Hopper"]


@pytest.mark.parametrize(
    ("text", "identifier", "name"),
    [
        (f"Ada Lovelace <{ORCID}>", f"https://orcid.org/{ORCID}", "Ada Lovelace"),
        (f"Ada Lovelace (https://orcid.org/{ORCID})", f"https://orcid.org/{ORCID}", "Ada Lovelace"),
        ("Ada Lovelace <ada@example.org>", "#person-ada-lovelace", "Ada Lovelace"),
        ("Émilie du Châtelet", "#person-milie-du-ch-telet", "Émilie du Châtelet"),
        ("艾达", "#person-unnamed", "艾达"),
    ],
)
def test_a_person_is_known_by_an_orcid_or_by_name(text: str, identifier: str, name: str) -> None:
    found = person(text)
    assert (found["@id"], found["name"]) == (identifier, name)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("CC0-1.0", {"@id": "https://spdx.org/licenses/CC0-1.0"}),
        ("https://example.org/terms", {"@id": "https://example.org/terms"}),
        ("for members of the consortium only", "for members of the consortium only"),
    ],
)
def test_a_licence_is_an_identifier_an_address_or_words(text: str, value: object) -> None:
    assert licence(text)[0] == value
