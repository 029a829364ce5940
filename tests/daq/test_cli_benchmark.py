"""The command that makes sealed cases."""

import json
from pathlib import Path

import pytest

from daq.cli import main


def test_a_wrong_label_ends_with_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["benchmark", "make", "--seed", "1", "--out", str(tmp_path / "cases"), "--only", "wobble"]
    assert main(arguments) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_cases_and_answers_are_told_as_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "cases"
    arguments = ["benchmark", "make", "--seed", "1", "--out", str(out), "--cases", "1", "--only", "none"]
    assert main([*arguments, "--quick", "--processes", "1", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["made"] == ["case001"]
    assert (out / "case001" / "pull" / "observations.csv").exists()
    assert (tmp_path / "cases-keys" / "case001.toml").exists()
