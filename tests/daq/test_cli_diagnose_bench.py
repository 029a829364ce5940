"""``retract diagnose`` on files of bench tests."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from daq.cli import main


def write_cycles(path: Path, *, slack: float = 0.0, rows: int = 40, unit: str = " (-)") -> Path:
    """Two cycles of a Neo-Hookean strip of 30 kPa, with 0.3 % of noise."""
    way = np.concatenate([np.linspace(0, 0.3, rows), np.linspace(0.3, 0, rows)])
    strain = np.concatenate([way, 1.5 * way])
    stretch = 1 + np.maximum(strain - slack, 0.0)
    noise = 0.03 * np.random.default_rng(1).normal(size=len(strain))
    stress = 10.0 * (stretch - stretch**-2) + noise
    lines = [f"{t},{e:.5f},{s:.4f}" for t, (e, s) in enumerate(zip(strain, stress, strict=True))]
    path.write_text("\n".join([f"Time (s),Strain{unit},Stress (kPa)", *lines]), encoding="utf-8")
    return path


def run(capsys: pytest.CaptureFixture[str], arguments: Sequence[object]) -> tuple[int, str, str]:
    status = main(["diagnose", *(str(argument) for argument in arguments)])
    out, err = capsys.readouterr()
    return status, out, err


def test_a_clean_record_is_none(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    status, out, err = run(capsys, [write_cycles(tmp_path / "clean.csv"), "--mode", "tension"])
    assert status == 0
    assert out.startswith("None: a Neo-Hookean law explains the tests.\n")
    assert err == "weighing causes\nholding against what is left out\n"


def test_json_is_one_object(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    record = write_cycles(tmp_path / "slack.csv", slack=0.04)
    status, out, _ = run(capsys, [record, "--mode", "tension", "--json"])
    assert (status, out.count("\n")) == (0, 1)
    data = json.loads(out)
    assert data["verdict"] == ["slack"]
    assert data["held_out"]["closure"] > 0.8
    assert data["sizes"][0]["value"] == pytest.approx(0.04, rel=0.1)


def test_output_gets_the_page(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    folder = tmp_path / "runs" / "clean"
    record = write_cycles(tmp_path / "clean.csv")
    status, out, _ = run(capsys, [record, "--mode", "tension", "--output", folder])
    assert status == 0
    assert out.endswith(f"Report: {folder / 'diagnosis.html'}\n")
    assert sorted(path.name for path in folder.iterdir()) == [
        "diagnosis.html",
        "diagnosis.json",
        "diagnosis.png",
    ]


def test_several_records_are_held_out_in_turn(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    records = [write_cycles(tmp_path / f"{rows}.csv", slack=0.04, rows=rows) for rows in (20, 40)]
    status, out, _ = run(capsys, [*records, "--mode", "tension"])
    assert status == 0
    assert out.startswith("Slack causes the gap")
    assert "Held out (each record)" in out


@pytest.mark.parametrize(
    ("options", "rows", "unit", "complaint"),
    [
        (["--mode", "tension"], 2, " (-)", "8 rows"),
        (["--mode", "tension", "--gauge-length", "20"], 40, " (-)", "--gauge-length"),
        (["--mode", "tension"], 40, " (parsec)", "parsec"),
    ],
)
def test_what_is_missing_is_said_in_one_line(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    options: list[str],
    rows: int,
    unit: str,
    complaint: str,
) -> None:
    record = write_cycles(tmp_path / "cycles.csv", rows=rows, unit=unit)
    status, out, err = run(capsys, [record, *options])
    assert (status, out) == (2, "")
    assert complaint in err
    assert err.count("\n") == 1


def test_files_and_folders_do_not_mix(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    status, _, err = run(capsys, [write_cycles(tmp_path / "cycles.csv"), tmp_path])
    assert status == 2
    assert "is no file" in err


@pytest.mark.parametrize(
    "option", [("--fix", "poisson_ratio=0.49"), ("--noise", "force_std=1"), ("--law", "yeoh2")]
)
def test_options_of_a_folder_are_refused_for_a_file(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, option: tuple[str, str]
) -> None:
    status, out, err = run(capsys, [write_cycles(tmp_path / "cycles.csv"), "--mode", "tension", *option])
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"retract: {option[0]}: is of a folder of experiments")


def test_options_of_a_file_are_refused_for_a_folder(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    status, out, err = run(capsys, [tmp_path, "--mode", "tension"])
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("retract: --mode: is of a file of bench tests")
