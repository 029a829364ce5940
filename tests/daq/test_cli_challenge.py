"""The verbs by which anyone enters the blind benchmark."""

import json
import shutil
from pathlib import Path

import pytest

from daq.cli import main

CONFORMANCE = Path(__file__).resolve().parents[2] / "examples" / "challenge" / "conformance"


@pytest.fixture
def example(tmp_path: Path) -> Path:
    """The conformance data, where openings may be counted."""
    return Path(shutil.copytree(CONFORMANCE, tmp_path / "example"))


def test_valid_answers_are_told_how_to_be_scored(example: Path, capsys: pytest.CaptureFixture[str]) -> None:
    answers, cases = str(example / "valid" / "whole.json"), str(example / "cases")
    assert main(["benchmark", "enter", answers, "--cases", cases, "--register", str(example / "keys")]) == 0
    said = capsys.readouterr().out
    assert "8 answers of 'worked example'" in said
    assert "retract benchmark leaderboard KEYS" in said
    assert (example / "keys" / "entries.txt").exists()
    assert not (example / "keys" / "openings.txt").exists()


def test_each_fault_is_a_line_and_the_status_is_two(
    example: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = example / "invalid" / "two_faults.json"
    assert main(["benchmark", "enter", str(file), "--register", str(example / "keys")]) == 2
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2 and all(line.startswith(f"{file}: answers.case0") for line in lines)
    assert not (example / "keys" / "entries.txt").exists()
    assert main(["benchmark", "enter", str(file), "--json"]) == 2
    assert len(json.loads(capsys.readouterr().out)["faults"]) == 2


@pytest.mark.parametrize("name", ["cut_off.json", "not_there.json"])
def test_what_is_no_json_is_one_line(example: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["benchmark", "enter", str(example / "invalid" / name)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_the_leaderboard_is_written_and_the_opening_counted(
    example: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answers = [str(example / "valid" / f"{name}.json") for name in ("minimal", "whole")]
    page = example / "board.md"
    assert main(["benchmark", "leaderboard", str(example / "keys"), *answers, "--output", str(page)]) == 0
    assert "1  worked example" in capsys.readouterr().out
    assert "| 1 | worked example |" in page.read_text()
    assert len((example / "keys" / "openings.txt").read_text().splitlines()) == 1


def test_a_leaderboard_of_no_kind_opens_nothing(example: Path) -> None:
    answers = str(example / "valid" / "whole.json")
    assert main(["benchmark", "leaderboard", str(example / "keys"), answers, "--output", "board.pdf"]) == 2
    assert not (example / "keys" / "openings.txt").exists()


def test_keys_are_revealed_if_they_are_those(example: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folders = [str(example / "cases"), str(example / "keys")]
    assert main(["benchmark", "reveal", *folders]) == 0
    assert "case03: gripper_slip (exact); E 15.00 kPa" in capsys.readouterr().out
    key = example / "keys" / "case03.toml"
    key.write_text(key.read_text().replace("gripper_slip", "force_bias"))
    assert main(["benchmark", "reveal", *folders]) == 2
    said = capsys.readouterr()
    assert said.out == "" and "case03.toml: is not the key that was committed to" in said.err
    assert len((example / "keys" / "openings.txt").read_text().splitlines()) == 1


def test_cases_of_ones_own_are_committed_to(example: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for file in (*example.glob("*/*.sha256"),):
        file.unlink()
    assert main(["benchmark", "commit", str(example / "cases"), str(example / "keys"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert len(told["keys"]) == 8
    assert main(["benchmark", "reveal", str(example / "cases"), str(example / "keys")]) == 0
