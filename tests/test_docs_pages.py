"""The documents against what they speak of: links, pictures, blocks of settings, and keys of drivers."""

import re
import tomllib
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import get_args, get_type_hints

import pytest
from doc_commands import DOCUMENTS, ROOT

from daq.devices import CAMERAS, FORCE_SENSORS, ROBOTS
from daq.files.toml_tables import TomlFile
from daq.plans import read_plan
from daq.viewers import Viewers

DRIVERS = {**FORCE_SENSORS, **ROBOTS, **CAMERAS}
FIRST_DAY = (ROOT / "docs" / "first-day.md").read_text(encoding="utf-8")
MOST_WORDS = 150
BLOCKS = [
    pytest.param(block, id=f"{path.name}-{number}")
    for path in DOCUMENTS
    for number, block in enumerate(
        re.findall(r"^```toml\n(.*?)^```", path.read_text(encoding="utf-8"), re.M | re.S)
    )
]


def anchors(text: str) -> set[str]:
    """What GitHub makes of the headings of a text."""
    headings = re.findall(r"^#+ (.*)$", text, re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_what_a_document_links_to_is_there(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if target.startswith("http"):
            continue
        name, _, anchor = target.partition("#")
        place = (path.parent / name).resolve() if name else path
        assert place.exists(), target
        assert place.is_relative_to(ROOT), target
        if anchor:
            assert anchor in anchors(place.read_text(encoding="utf-8")), target


def linked_pages(path: Path) -> set[Path]:
    """The documents that a document links to."""
    targets = re.findall(r"\]\(([^)\s#]+)", path.read_text(encoding="utf-8"))
    return {(path.parent / t).resolve() for t in targets if not t.startswith("http")} & set(DOCUMENTS)


def test_links_lead_from_the_readme_to_every_document() -> None:
    reached, ahead = set(), {ROOT / "README.md"}
    while ahead:
        reached |= ahead
        ahead = set().union(*map(linked_pages, ahead)) - reached
    assert set(DOCUMENTS) - reached == set()
    assert ROOT / "docs" / "README.md" in linked_pages(ROOT / "README.md")


def test_every_picture_is_shown_somewhere() -> None:
    shown = {
        (path.parent / target).resolve()
        for path in DOCUMENTS
        for target in re.findall(r"!\[[^\]]*\]\(([^)\s]+)\)", path.read_text(encoding="utf-8"))
    }
    pictures = {p for p in (ROOT / "docs").rglob("*") if p.suffix in (".png", ".svg", ".jpg", ".gif")}
    assert pictures - shown == set()


def paragraphs(text: str) -> list[str]:
    """The paragraphs and items of lists of a text, without code and tables."""
    without_code = re.sub(r"^ *```.*?^ *```", "", text, flags=re.M | re.S)
    prose = re.sub(r"^ *\|.*$", "", without_code, flags=re.M)
    return re.split(r"\n\s*\n|\n(?=\s*(?:[-*]|\d+\.) )", prose)


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_no_paragraph_is_long(path: Path) -> None:
    lengths = {part.strip()[:60]: len(part.split()) for part in paragraphs(path.read_text(encoding="utf-8"))}
    assert {start: words for start, words in lengths.items() if words > MOST_WORDS} == {}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("one two\nthree\n\nfour", [3, 1]),
        ("* one\n* two three", [2, 3]),
        ("a\n\n```sh\nmany words of code\n```\n\nb", [1, 1]),
        ("a b\n\n| a | table |\n| - | - |\n", [2]),
    ],
)
def test_a_paragraph_is_what_a_reader_takes_for_one(text: str, words: list[int]) -> None:
    assert [len(part.split()) for part in paragraphs(text) if part.strip()] == words


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_a_file_of_the_project_that_a_document_names_is_there(path: Path) -> None:
    rooms = "daq|docs|estimator|gui|robot_drivers|tests|benchmarks"
    named = re.findall(
        rf"`((?:{rooms})/[\w/.-]+\.(?:py|toml|yml|md|json))`", path.read_text(encoding="utf-8")
    )
    assert [name for name in named if not (ROOT / name).exists()] == []


def test_the_version_stands_in_one_place_and_the_licence_is_one() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert not re.search(r"^version:", citation, re.M)
    for text in (citation, *((ROOT / name).read_text(encoding="utf-8") for name in ("LICENSE", "README.md"))):
        assert project["license"] in text


@pytest.mark.parametrize("block", BLOCKS)
def test_a_block_of_settings_is_one_that_the_program_takes(block: str, tmp_path: Path) -> None:
    place = tmp_path / "settings.toml"
    place.write_text(block, encoding="utf-8")
    root = tomllib.loads(block)
    if root.get("format") == "retraction-plan/1":
        assert read_plan(place).trials
        return
    file = TomlFile.read(place)
    if root.keys() == {"viewers"}:
        assert file.build(Viewers, root["viewers"], ("viewers",))
        return
    devices = [(key, root[key]) for key in ("force_sensor", "robot") if key in root]
    devices += [("cameras", camera) for camera in root.get("cameras", [])]
    assert devices
    for role, device in devices:
        of_role = {"force_sensor": FORCE_SENSORS, "robot": ROBOTS, "cameras": CAMERAS}[role]
        assert file.build(of_role[device["driver"]].settings, device.get("settings", {}), (role, "settings"))


@pytest.mark.parametrize(
    ("driver", "key"), sorted(set(re.findall(r"`(\w+(?:\.\w+)?): (\w+)`", FIRST_DAY))), ids=lambda part: part
)
def test_a_setting_that_the_first_day_settles_is_one_of_its_driver(driver: str, key: str) -> None:
    name, _, inner = driver.partition(".")
    settings = DRIVERS[name].settings
    if inner:
        hint = get_type_hints(settings)[inner]
        settings = next(kind for kind in (hint, *get_args(hint)) if is_dataclass(kind))
    assert key in {field.name for field in fields(settings)}


def test_a_robot_that_is_guided_over_the_network_has_its_controller_named() -> None:
    """Without an address only this computer is heard, and a newcomer waits for datagrams that never come."""
    guided = [
        root["robot"]["settings"]
        for root in (tomllib.loads(block.values[0]) for block in BLOCKS)
        if root.get("robot", {}).get("driver") == "egm_guidance"
    ]
    assert guided
    assert all(settings["egm"]["controller_address"] for settings in guided)


def test_every_driver_has_its_page() -> None:
    pages = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "docs" / "hardware").glob("*.md"))
    assert [name for name in DRIVERS if f'driver = "{name}"' not in pages] == []
