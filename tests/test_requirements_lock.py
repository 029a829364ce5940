import re
import tomllib
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[1]
LOCK = (ROOT / "requirements.lock").read_text(encoding="utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
PINNED = {
    canonicalize_name(name): version for name, version in re.findall(r"^([\w.-]+)==(\S+)", LOCK, re.MULTILINE)
}


def is_pinned_within_range(requirement: Requirement) -> bool:
    pin = PINNED.get(canonicalize_name(requirement.name))
    return pin is not None and requirement.specifier.contains(pin)


def test_the_lock_pins_every_declared_requirement_within_its_range() -> None:
    declared = PROJECT["dependencies"] + PROJECT["optional-dependencies"]["dev"]
    stale = [text for text in declared if not is_pinned_within_range(Requirement(text))]
    assert stale == [], "compile requirements.lock again (CONTRIBUTING.md, Set-up)"


def test_every_pin_carries_hashes_and_names_no_index() -> None:
    pins = re.split(r"^(?=[\w.-]+==)", LOCK, flags=re.MULTILINE)[1:]
    assert [pin.splitlines()[0] for pin in pins if "--hash=sha256:" not in pin] == []
    assert "://" not in LOCK
