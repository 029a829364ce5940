"""A share of the broken forms of every kind of input, and the judge of them on readers with known faults."""

import pickle
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.bad_input.campaign import run_kind
from daq.bad_input.damage.any_file import emptied
from daq.bad_input.kind import Kind
from daq.bad_input.kinds import KINDS
from daq.cli.verb import Result, concluded
from daq.errors import DaqError, RigError
from estimator.errors import EstimatorError
from estimator.input_file import LARGEST_NUMBER, parse_number, read_input
from robot_drivers.errors import DeviceError

NAMES = [kind.name for kind in KINDS]


@pytest.mark.parametrize("kind", KINDS, ids=NAMES)
def test_every_broken_form_is_refused_in_one_line_and_leaves_nothing_behind(kind: Kind) -> None:
    tally = run_kind(kind, seed=20, numbers=range(4))
    assert [finding.verdict.complaint for finding in tally.findings] == []
    assert tally.forms == 4


def test_a_kind_has_a_name_of_its_own() -> None:
    assert len(set(NAMES)) == len(NAMES)


def test_the_command_tells_a_table() -> None:
    command = [sys.executable, "-m", "daq.bad_input", "--count", "2", "--only", "STL", "tensile record"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=100, check=True)
    rows = [line.split() for line in done.stdout.splitlines()]
    assert rows[1][:2] == ["STL", "2"]
    assert rows[3][:2] == ["all", "4"]
    assert rows[3][-1] == "0"


# ---- the judge


def written(folder: Path) -> None:
    (folder / "file").write_text("valid")


def finding_in(read: Callable[[Path], object]) -> str:
    """What the judge has against a reader, whose file is emptied; empty if nothing."""

    def unless_valid(folder: Path) -> object:
        return None if (folder / "file").read_text() == "valid" else read(folder)

    kind = Kind(
        "made up", written, {"file": (emptied,)}, unless_valid, places=(lambda file: file.write_text(""),)
    )
    (*findings,) = run_kind(kind, seed=1, numbers=range(1)).findings
    return findings[0].verdict.complaint if findings else ""


def refuse(text: str) -> None:
    raise RigError(text)


def test_a_refusal_in_one_line_is_sound() -> None:
    assert finding_in(lambda folder: refuse(f"{folder / 'file'}: is empty; write it")) == ""


def test_an_error_that_nobody_translates_is_a_finding() -> None:
    assert "KeyError" in finding_in(lambda folder: {}[folder])


def test_a_second_line_is_a_finding_even_where_a_library_writes_it() -> None:
    def warn(_folder: Path) -> None:
        warnings.warn("overflow", RuntimeWarning, stacklevel=1)
        refuse("no")

    assert "lines on standard error" in finding_in(warn)


def test_what_is_written_on_the_way_to_a_refusal_is_a_finding() -> None:
    def write_half(folder: Path) -> None:
        (folder.parent / "out" / "half").write_text("half")
        refuse("no")

    assert finding_in(write_half) == "wrote half"


def test_a_changed_input_is_a_finding() -> None:
    def change(folder: Path) -> None:
        (folder / "file").write_text("mended?")
        refuse("no")

    assert finding_in(change) == "changed file of the input"


def test_an_unpickled_class_is_a_finding() -> None:
    harmful = pickle.dumps(Path("x"))

    def unpickle(_folder: Path) -> None:
        pickle.loads(harmful)
        refuse("no")

    assert finding_in(unpickle).startswith("executed something: pickle.find_class")


# ---- any bytes at all

SINGLE = [kind for kind in KINDS if all("*" not in pattern for pattern in kind.damages)]


@pytest.mark.parametrize("kind", SINGLE, ids=[kind.name for kind in SINGLE])
def test_a_reader_takes_any_bytes_or_refuses_them_as_it_says(kind: Kind, tmp_path: Path) -> None:
    kind.write(tmp_path)
    files = [tmp_path / pattern for pattern in kind.damages]
    valid = {file: file.read_bytes() for file in files}

    @settings(deadline=None, derandomize=True, max_examples=8, database=None)
    @given(
        place=st.integers(0, 10**6),
        piece=st.binary(max_size=12),
        whole=st.booleans(),
        which=st.integers(0, 9),
    )
    def holds(place: int, piece: bytes, whole: bool, which: int) -> None:
        file = files[which % len(files)]
        content = valid[file]
        begin = place % len(content)
        file.write_bytes(piece if whole else content[:begin] + piece + content[begin + len(piece) :])
        try:
            kind.read(tmp_path)
        except (DaqError, EstimatorError, DeviceError) as error:
            assert str(error)
        finally:
            for each, before in valid.items():
                each.write_bytes(before)

    holds()


@settings(deadline=None, derandomize=True)
@given(st.floats(-LARGEST_NUMBER, LARGEST_NUMBER))
def test_a_written_number_is_read_back(value: float) -> None:
    assert parse_number(repr(value)) == value


@pytest.mark.parametrize("text", ["", "1_0", "0x10", "٣", "1e400", "1,5", "12 N", "--1", "9" * 400, "True"])
def test_what_only_a_program_takes_for_a_number_is_none(text: str) -> None:
    with pytest.raises(ValueError, match=r"no decimal number|larger than any quantity"):
        parse_number(text)


# ---- the line of a refusal


@given(st.text(max_size=60))
@settings(deadline=None, derandomize=True, max_examples=60)
def test_whatever_a_file_says_a_refusal_is_one_printable_line(said: str) -> None:
    def run() -> Result:
        raise RigError(f"a name {said!s} cannot be right")

    with tempfile.TemporaryFile("w+", encoding="utf-8") as stream, pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "stderr", stream)
        assert concluded(run, as_json=False) == 2
        stream.seek(0)
        told = stream.read()
    assert told.endswith("\n")
    assert told[:-1].isprintable()


def test_a_refusal_is_never_endless(capsys: pytest.CaptureFixture[str]) -> None:
    def run() -> Result:
        raise RigError("begin " + "x" * 1_000_000 + " end")

    concluded(run, as_json=False)
    told = capsys.readouterr().err
    assert len(told) < 1500
    assert "begin" in told
    assert told.endswith("end\n")


@pytest.mark.skipif(sys.platform == "win32", reason="no such devices")
def test_neither_a_device_nor_an_enormous_file_is_opened(tmp_path: Path) -> None:
    with pytest.raises(EstimatorError, match="device"):
        read_input(Path("/dev/zero"), 10)
    large = tmp_path / "large"
    with large.open("wb") as stream:
        stream.truncate(20_000_000_000)
    with pytest.raises(EstimatorError, match="20000 MB"):
        read_input(large, 10)


def test_a_kind_that_is_not_valid_before_it_is_broken_is_no_test_of_anything() -> None:
    kind = replace(KINDS[0], read=lambda folder: refuse("never valid"))
    with pytest.raises(RigError, match="never valid"):
        run_kind(kind, seed=0, numbers=range(1))
