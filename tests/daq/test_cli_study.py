"""The verb ``study``, with a study that costs no time."""

import json
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from synthetic_diagnoses import small_experiment

from daq.cli import main
from estimator.experiment import write_experiment
from estimator.studies.phantom_tables.recorded import RecordedRetraction
from estimator.studies.running.arrays import as_text
from estimator.studies.running.case import Parametric, Row
from estimator.studies.tables.study import Group, Level, Study, Truth


@dataclass(frozen=True)
class Drawn(Parametric):
    number: int

    @property
    def name(self) -> str:
        return f"draw {self.number}"

    def run(self) -> Row:
        return {"youngs_modulus": 15e3 + 100 * self.number, "poisson_ratio": 0.49, "seconds": 1.0}


def estimated(case: RecordedRetraction) -> Row:
    """Stand in for the estimate of a recorded experiment, which takes its time."""
    one = case.experiment
    return {
        "youngs_modulus": 15e3,
        "youngs_modulus_low": 14.5e3,
        "youngs_modulus_high": 15.6e3,
        "poisson_ratio": 0.49,
        "poisson_ratio_low": 0.485,
        "poisson_ratio_high": 0.494,
        "seconds": 1.0,
        "iterations": 5,
        "calls": 7,
        "rmse_fiducials": 1e-4,
        "rmse_force": 2e-3,
        "predicted_force": as_text(one.wrench[:, :3]),
        "predicted_fiducials": as_text(one.fiducials),
    }


def one_study(names: Sequence[str], draws: int) -> list[Study]:
    levels = (Level("5 mm", tuple(Drawn(number) for number in range(draws))),)
    return [Study(names[0], "Grasps", (), (Group("pulls", levels, Truth(15e3, 0.49)),))]


@contextmanager
def threads(workers: int | None) -> Iterator[Executor]:
    with ThreadPoolExecutor(workers or 2) as pool:
        yield pool


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("daq.cli.estimation.study.studies_named", one_study)
    monkeypatch.setattr("daq.cli.workers.worker_pool", threads)


def run(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    status = main([str(argument) for argument in arguments])
    out, err = capsys.readouterr()
    return status, out, err


def test_study_prints_its_table_writes_its_page_and_goes_on(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    status, out, err = run(capsys, "study", "table3", "--draws", 2, "--output", tmp_path)
    assert status == 0
    assert "2 of 2" in out
    assert out.endswith(f"Report: {tmp_path / 'studies.html'}\n")
    assert err.startswith("0 of 2 cases are known\n")
    assert (tmp_path / "table3.png").exists()
    status, out, err = run(capsys, "study", "table3", "--draws", 3, "--output", tmp_path, "--json")
    assert status == 0
    assert json.loads(out)["studies"]["table3"]["groups"][0]["levels"][0]["youngs_modulus"] == [
        15000.0,
        15100.0,
        15200.0,
    ]
    assert err.startswith("2 of 3 cases are known\n")


def test_recorded_experiments_are_tables_in_the_papers_layout_beside_the_bench_test(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("estimator.studies.phantom_tables.recorded.RecordedRetraction.run", estimated)
    for phantom, order in (("P07", 1), ("P08", 1)):
        one = replace(small_experiment("pull", order), phantom_id=phantom)
        write_experiment(one, tmp_path / phantom / "pull")
    folders = (tmp_path / "P07", tmp_path / "P08")
    status, out, _ = run(capsys, "study", *folders, "--bench", "P07=15000±900", "--output", tmp_path / "out")
    assert status == 0
    assert "Tables VI and VII" in out
    lines = out.splitlines()
    head = next(line for line in lines if "P07" in line and "P08" in line)
    assert len(head.split("  ")) > 1
    assert any(line.startswith("  bench test, Pa") and "15000 ± 900" in line for line in lines)
    assert any(line.startswith("  ν, 95 %") and ".." in line for line in lines)
    assert "the paper's Table VII, two sides anchored" in out
    assert "26450" in out
    assert (tmp_path / "out" / "table8.png").stat().st_size > 10_000
    assert "table8.png" in str(list((tmp_path / "out").iterdir()))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("table9",), "'table9' is neither a study (table1, table2"),
        (("table1", "."), "give studies or folders alone"),
        (("table1", "--workers", "0"), "at least one is needed"),
        (("gap", "a.toml", "b.toml"), "takes one published table"),
        (("gap", "missing.toml"), "there is no such file"),
        (("gap", "--check", "wind"), "'wind' is no cause that is simulated"),
        (("gap", "--check", "mullins+mullins"), "neither one cause nor two"),
        (("table1", "--check", "mullins"), "--check belongs to gap"),
        (("table1", "--bench", "P07"), "write PHANTOM=E±DEVIATION"),
        (("table1", "--bench", "P07=0±1"), "no number above zero"),
        (("table1", "--bench", "P07=1000±1"), "no such phantom was recorded"),
    ],
)
def test_wrong_input_ends_with_one_line_and_status_2(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, arguments: tuple[str, ...], words: str
) -> None:
    status, out, err = run(capsys, "study", *arguments, "--output", tmp_path / "out")
    assert (status, out) == (2, "")
    assert err.startswith("retract: ")
    assert err.count("\n") == 1
    assert words in err


def test_study_has_help_with_examples(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main(["study", "--help"])
    out = capsys.readouterr().out
    assert "retract study table1" in out
    assert "--scheduler tcp://HOST:PORT" in out
