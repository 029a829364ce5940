import re
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[1]
TO_RUN, TO_TEST = (
    (ROOT / name).read_text(encoding="utf-8") for name in ("requirements.lock", "requirements-dev.lock")
)
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS = PROJECT["optional-dependencies"]


def pins(lock: str) -> dict[str, str]:
    """The pinned versions by name."""
    found = re.findall(r"^([\w.-]+)==(\S+)", lock, re.MULTILINE)
    return {canonicalize_name(name): version for name, version in found}


@pytest.mark.parametrize(
    ("lock", "declared"),
    [
        (TO_RUN, PROJECT["dependencies"] + EXTRAS["build"]),
        (TO_TEST, PROJECT["dependencies"] + EXTRAS["build"] + EXTRAS["dev"]),
    ],
    ids=["to run", "to test"],
)
def test_a_lock_pins_every_declared_requirement_within_its_range(lock: str, declared: list[str]) -> None:
    pinned = pins(lock)
    wanted = [Requirement(text) for text in declared]
    stale = [
        str(requirement)
        for requirement in wanted
        if not requirement.specifier.contains(pinned.get(canonicalize_name(requirement.name), "0"))
    ]
    assert stale == [], "compile both locks again (CONTRIBUTING.md, Set-up)"


def test_the_tests_run_with_the_versions_that_are_run() -> None:
    assert pins(TO_RUN).items() <= pins(TO_TEST).items()


def test_what_runs_holds_nothing_that_only_the_checks_need() -> None:
    only_checks = {canonicalize_name(Requirement(text).name) for text in EXTRAS["dev"]}
    assert only_checks & pins(TO_RUN).keys() == set()


@pytest.mark.parametrize("lock", [TO_RUN, TO_TEST], ids=["to run", "to test"])
def test_every_pin_carries_hashes_and_names_no_index(lock: str) -> None:
    parts = re.split(r"^(?=[\w.-]+==)", lock, flags=re.MULTILINE)[1:]
    assert [part.splitlines()[0] for part in parts if "--hash=sha256:" not in part] == []
    assert "://" not in lock
