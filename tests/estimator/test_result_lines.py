"""Results of a campaign, kept line by line."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

from estimator.errors import InputError
from estimator.fit import coverage
from estimator.result_lines import append_result, read_results


@dataclass(frozen=True)
class Result:
    """Of a made-up campaign."""

    number: int
    label: str
    share: float
    remarks: tuple[str, ...]
    intervals: Mapping[str, Sequence[float]]

    def __post_init__(self) -> None:
        if self.share < 0:
            raise ValueError("a share is not negative")


ONE = Result(1, "first", 0.5, ("a", "b"), {"E": [1.0, 2.0]})
TWO = Result(2, "second", 1.0, (), {})


def test_what_was_appended_is_read_back(tmp_path: Path) -> None:
    file = tmp_path / "results.jsonl"
    assert read_results(Result, file) == []
    append_result(file, ONE)
    append_result(file, TWO)
    assert read_results(Result, file) == [ONE, TWO]


def test_a_line_that_was_cut_off_is_left_out_and_ended(tmp_path: Path) -> None:
    file = tmp_path / "results.jsonl"
    append_result(file, ONE)
    with file.open("ab") as stream:
        stream.write('{"number": 2, "label": "é'.encode()[:-1])
    append_result(file, TWO)
    assert read_results(Result, file) == [ONE, TWO]


def test_a_number_may_be_none_of_any_size(tmp_path: Path) -> None:
    file = tmp_path / "results.jsonl"
    append_result(file, Result(1, "failed", math.nan, (), {}))
    (found,) = read_results(Result, file)
    assert math.isnan(found.share)


@pytest.mark.parametrize(
    "entry, value",
    [
        ("number", 1.5),
        ("number", True),
        ("number", 10**30),
        ("label", None),
        ("share", "much"),
        ("share", 1e300),
        ("share", -1.0),
        ("remarks", "a"),
        ("remarks", [1]),
        ("intervals", {"E": [1.0, "x"]}),
        ("intervals", []),
        ("another", 1),
    ],
)
def test_a_line_that_is_no_result_is_told_by_its_number(tmp_path: Path, entry: str, value: object) -> None:
    file = tmp_path / "results.jsonl"
    append_result(file, ONE)
    line = json.dumps({**json.loads(file.read_text()), entry: value})
    file.write_text(f"{file.read_text()}{line}\n")
    with pytest.raises(InputError, match=r"results\.jsonl, line 2: .*remove the line"):
        read_results(Result, file)


@pytest.mark.parametrize("content", ["[]\n", "null\n", "{\n", "[" * 50_000 + "\n", "\0\n"])
def test_a_file_of_something_else_is_refused_and_left_alone(tmp_path: Path, content: str) -> None:
    file = tmp_path / "results.jsonl"
    file.write_text(content)
    with pytest.raises(InputError, match=r"results\.jsonl"):
        read_results(Result, file)
    assert file.read_text() == content


def test_the_coverage_refuses_a_damaged_file_before_it_computes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "sets.jsonl"
    truth = {"youngs_modulus": 1e4, "poisson_ratio": 0.45}
    append_result(file, coverage.Outcome(0, truth, {}, {}, math.nan, "no convergence"))
    file.write_text(file.read_text().replace("no convergence", ""))
    with pytest.raises(SystemExit) as end:
        coverage.main(["--sets", "3", "--output", str(file)])
    assert end.value.code == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "sets.jsonl, line 1: youngs_modulus or poisson_ratio is missing" in told
