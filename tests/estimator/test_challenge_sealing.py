"""Commit and reveal: hashes that keys must match, openings that are counted, answers that were there before."""

import shutil
import subprocess
import tomllib
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from estimator.blind.scoring.keys import open_keys
from estimator.blind.sealing.commitment import check_cases, check_keys, commit, read_commitment
from estimator.blind.sealing.openings import Openings, count_opening, read_openings
from estimator.blind.sealing.register import hash_of_answers, register, registered, standing
from estimator.blind.sealing.secret_seed import secret_seed
from estimator.errors import InputError

KEY = 'effects = ["gripper_slip"]\nyoungs_modulus = 15000.0\npoisson_ratio = 0.45\n'


@pytest.fixture
def cases(tmp_path: Path) -> Path:
    """A set of two cases and their keys, committed to."""
    for name in ("one", "two"):
        folder = tmp_path / "cases" / name / "pull"
        folder.mkdir(parents=True)
        (folder / "observations.csv").write_text(f"time,px\n0.0,{len(name)}\n")
        (folder / "phantom.stl").write_bytes(b"solid\r\n")
        (tmp_path / "keys").mkdir(exist_ok=True)
        (tmp_path / "keys" / f"{name}.toml").write_text(KEY)
    commit(tmp_path / "cases", tmp_path / "keys")
    return tmp_path / "cases"


@pytest.fixture
def keys(cases: Path) -> Path:
    return cases.with_name("keys")


def test_keys_and_cases_are_those_that_were_committed_to(cases: Path, keys: Path) -> None:
    published = read_commitment(cases)
    check_cases(cases, published)
    check_keys(keys, published)
    assert read_commitment(keys) == published
    assert set(published.keys) == {"one.toml", "two.toml"}


def alter_a_number(folder: Path) -> None:
    file = folder / "one.toml"
    file.write_text(file.read_text().replace("15000.0", "15000.1"))


def alter_the_salt(folder: Path) -> None:
    file = folder / "one.toml"
    file.write_text(file.read_text().replace('salt = "', 'salt = "0'))


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (alter_a_number, r"one\.toml: is not the key that was committed to"),
        (alter_the_salt, r"one\.toml: is not the key that was committed to"),
        (
            lambda folder: (folder / "one.toml").unlink(),
            r"one\.toml: this key was committed to and is missing",
        ),
        (lambda folder: shutil.copy(folder / "one.toml", folder / "three.toml"), r"three\.toml: was never"),
        (lambda folder: (folder / "keys.sha256").write_text("nothing"), r"keys\.sha256: does not begin as"),
    ],
    ids=["altered", "salted anew", "missing", "added", "no commitment"],
)
def test_keys_that_were_tampered_with_are_not_opened(
    keys: Path, change: Callable[[Path], object], complaint: str
) -> None:
    change(keys)
    with pytest.raises(InputError, match=complaint):
        open_keys(keys, "a test")
    assert read_openings(keys).count == 0


def test_keys_and_lists_that_were_both_tampered_with_are_found_by_what_was_published(
    cases: Path, keys: Path
) -> None:
    published = read_commitment(cases)
    (keys / "keys.sha256").unlink()
    alter_a_number(keys)
    shutil.copytree(cases, cases.with_name("others"))
    commit(cases.with_name("others"), keys)
    open_keys(keys, "a test that knows nothing of what was published")
    with pytest.raises(InputError, match="is not the key that was committed to"):
        check_keys(keys, published)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda file: file.write_text("time,px\n0.0,9\n"), "missing or not as it was published"),
        (lambda file: file.unlink(), "missing or not as it was published"),
        (lambda file: file.with_name("more.csv").write_text("a\n"), r"more\.csv: is no part"),
        (lambda file: (file.parents[2] / "cases.sha256").write_text(""), r"cases\.sha256: is not the list"),
    ],
    ids=["altered", "missing", "added", "another list"],
)
def test_cases_that_were_tampered_with_are_found(
    cases: Path, change: Callable[[Path], object], complaint: str
) -> None:
    published = read_commitment(cases)
    change(cases / "one" / "pull" / "observations.csv")
    with pytest.raises(InputError, match=complaint):
        check_cases(cases, published)


def test_line_ends_that_a_version_control_has_turned_change_no_hash(cases: Path, keys: Path) -> None:
    published = read_commitment(cases)
    texts = [keys / "one.toml", cases / "one" / "pull" / "observations.csv", cases / "keys.sha256"]
    for file in [*texts, cases / "cases.sha256"]:
        file.write_bytes(file.read_bytes().replace(b"\n", b"\r\n"))
    assert read_commitment(cases) == published
    check_keys(keys, published)
    check_cases(cases, published)


@pytest.mark.skipif(shutil.which("sha256sum") is None, reason="sha256sum is not there")
def test_the_lists_are_checked_by_sha256sum(cases: Path, keys: Path) -> None:
    for folder, name in ((keys, "keys.sha256"), (cases, "cases.sha256")):
        done = subprocess.run(
            ["sha256sum", "--strict", "-c", name], cwd=folder, capture_output=True, check=False
        )
        assert done.returncode == 0, done.stderr
    told = subprocess.run(["sha256sum", "keys.sha256"], cwd=cases, capture_output=True, text=True, check=True)
    assert told.stdout.split()[0] == read_commitment(cases).set_hash


def test_each_key_has_a_salt_of_its_own_which_stays(cases: Path, keys: Path) -> None:
    salts = [tomllib.loads((keys / f"{name}.toml").read_text())["salt"] for name in ("one", "two")]
    assert len(set(salts)) == 2 and all(len(salt) == 64 for salt in salts)
    assert len(set(read_commitment(cases).keys.values())) == 2  # though the keys say the same
    assert commit(cases, keys) == read_commitment(cases)
    assert [tomllib.loads((keys / f"{name}.toml").read_text())["salt"] for name in ("one", "two")] == salts


def test_a_set_may_be_added_to_and_not_altered(cases: Path, keys: Path) -> None:
    before = read_commitment(cases)
    shutil.copytree(cases / "one", cases / "three")
    (keys / "three.toml").write_text(KEY)
    after = commit(cases, keys)
    assert after.keys.items() > before.keys.items()
    alter_a_number(keys)
    with pytest.raises(InputError, match=r"one\.toml: is not the key"):
        commit(cases, keys)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda keys: (keys / "one.toml").unlink(), "one: this case has no key"),
        (lambda keys: (keys / "six.toml").write_text(KEY), "six: this key has no case"),
        (lambda keys: (keys / "one.toml").write_text(f'salt = "1234"\n{KEY}'), "salt must be"),
        (lambda keys: [file.unlink() for file in keys.glob("*.toml")], "holds no key"),
    ],
)
def test_what_cannot_be_committed_to_is_told(
    cases: Path, keys: Path, change: Callable[[Path], object], complaint: str
) -> None:
    (keys / "keys.sha256").unlink()
    change(keys)
    with pytest.raises(InputError, match=complaint):
        commit(cases, keys)


@pytest.mark.parametrize(
    "line", ["0" * 63 + "  one.toml", "0" * 64 + "  ../one.toml", "0" * 64 + "  /etc/passwd"]
)
def test_a_list_that_leads_elsewhere_is_refused(cases: Path, line: str) -> None:
    file = cases / "keys.sha256"
    file.write_text(f"{file.read_text()}{line}\n")
    with pytest.raises(InputError, match=r"keys\.sha256:5: is no line"):
        read_commitment(cases)


def test_openings_are_counted_and_dated(keys: Path) -> None:
    before = datetime.now(UTC) - timedelta(seconds=1)
    found = [count_opening(keys, reason) for reason in ("once", "twice\nand more")]
    assert [one.count for one in found] == [1, 2]
    assert found[0].first == found[1].first
    assert found[0].first is not None and before <= found[0].first <= datetime.now(UTC)
    assert (keys / "openings.txt").read_text().splitlines()[1].endswith(" twice and more")


def test_an_opening_without_a_date_is_counted(keys: Path) -> None:
    (keys / "openings.txt").write_text("somebody looked")
    assert read_openings(keys) == Openings(1, None)
    assert count_opening(keys, "again").count == 2


def test_answers_are_registered_once(tmp_path: Path) -> None:
    (tmp_path / "answers.json").write_text("{}")
    own = hash_of_answers(tmp_path / "answers.json")
    dates = [register(tmp_path / "keys", own, "by\nme") for _ in range(2)]
    assert dates[0] == dates[1] == registered(tmp_path / "keys")[own]
    assert (tmp_path / "keys" / "entries.txt").read_text().splitlines()[0].endswith(f"{own} by me")


NOON = datetime(2026, 11, 28, 12, tzinfo=UTC)
HOUR = timedelta(hours=1)


@pytest.mark.parametrize(
    ("answered", "registered_at", "told"),
    [
        (NOON - HOUR, NOON - HOUR, "registered before the keys were opened"),
        (NOON + HOUR, NOON - HOUR, "registered before the keys were opened"),
        (NOON - HOUR, NOON + HOUR, "dated before, unregistered"),
        (NOON - HOUR, None, "dated before, unregistered"),
        (NOON + HOUR, NOON + HOUR, "after an opening"),
        (NOON + HOUR, None, "after an opening"),
    ],
)
def test_answers_stand_by_when_they_were_registered_or_say_they_were_given(
    answered: datetime, registered_at: datetime | None, told: str
) -> None:
    assert standing(answered, registered_at, Openings(2, NOON)) == told


def test_a_secret_seed_is_kept_and_is_another_elsewhere(tmp_path: Path) -> None:
    seeds = [secret_seed(tmp_path / name) for name in ("a", "a", "b")]
    assert seeds[0] == seeds[1] != seeds[2]
    assert seeds[0] > 10**9
    (tmp_path / "a" / "seed.txt").write_text("seven")
    with pytest.raises(InputError, match="holds no seed"):
        secret_seed(tmp_path / "a")
