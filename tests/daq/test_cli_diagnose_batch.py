"""``retract diagnose`` of a folder of cases, with a stand-in for the diagnosis."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from synthetic_diagnoses import inclusion, small_experiment

from daq.cli import main
from daq.progress import Progress
from estimator.diagnosis.result import Diagnosis
from estimator.errors import FitError
from estimator.experiment import Experiment, write_experiment
from estimator.fit.settings import FitSettings


def stand_in(
    experiments: Sequence[Experiment], tell: Progress | None, material: FitSettings | None = None
) -> Diagnosis:
    if experiments[0].phantom_id == "P09":
        raise FitError("the data do not determine the parameters")
    return inclusion()


def forbidden(
    experiments: Sequence[Experiment], tell: Progress | None, material: FitSettings | None = None
) -> Diagnosis:
    raise AssertionError("this case was diagnosed before")


def unread(found: Diagnosis, experiments: Sequence[Experiment], case: str) -> str:
    return "a page that no test reads"


@pytest.fixture
def cases(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("daq.cli.diagnosis.batch.diagnose", stand_in)
    for name in ("P07", "P08"):
        write_experiment(small_experiment("pull", 1), tmp_path / "cases" / name / "pull")
    return tmp_path / "cases"


def run(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    status = main([str(argument) for argument in arguments])
    out, err = capsys.readouterr()
    return status, out, err


def test_each_case_gets_a_page_and_a_line(
    capsys: pytest.CaptureFixture[str], cases: Path, tmp_path: Path
) -> None:
    status, out, _ = run(capsys, "diagnose", cases, "--output", tmp_path / "runs")
    assert status == 0
    lines = out.splitlines()
    assert [line.split()[:3] for line in lines[1:3]] == [
        ["P07", "inhomogeneity,", "93%"],
        ["P08", "inhomogeneity,", "93%"],
    ]
    assert lines[-1] == f"2 cases diagnosed, 0 had been; pages in {tmp_path / 'runs'}"
    for name in ("P07", "P08"):
        page = (tmp_path / "runs" / name / "diagnosis.html").read_text("utf-8")
        assert "Inhomogeneity (93 %)" in page
        assert str(cases / name) in page
        data = json.loads((tmp_path / "runs" / name / "diagnosis.json").read_text("utf-8"))
        assert data["verdict"] == ["inhomogeneity"]


def test_the_same_command_goes_on_where_it_stopped(
    capsys: pytest.CaptureFixture[str], cases: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("daq.cli.diagnosis.batch.page_of", unread)
    command = ("diagnose", cases, "--output", tmp_path / "runs", "--json")
    _, first, _ = run(capsys, *command)
    monkeypatch.setattr("daq.cli.diagnosis.batch.diagnose", forbidden)
    status, again, _ = run(capsys, *command)
    assert status == 0
    assert json.loads(again) == json.loads(first)


def test_diagnoses_with_other_options_are_not_mixed(
    capsys: pytest.CaptureFixture[str], cases: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("daq.cli.diagnosis.batch.page_of", unread)
    run(capsys, "diagnose", cases, "--output", tmp_path / "runs")
    status, out, err = run(
        capsys, "diagnose", cases, "--output", tmp_path / "runs", "--fix", "poisson_ratio=0.49"
    )
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "--fix" in err
    assert "name another folder" in err


def test_a_case_without_a_diagnosis_is_told_and_the_others_are_kept(
    capsys: pytest.CaptureFixture[str], cases: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("daq.cli.diagnosis.batch.page_of", unread)
    odd = replace(small_experiment("pull", 1), phantom_id="P09")
    write_experiment(odd, cases / "P09" / "pull")
    status, out, _ = run(capsys, "diagnose", cases, "--output", tmp_path / "runs")
    assert status == 1
    assert "no diagnosis of P09: the data do not determine the parameters" in out
    assert (tmp_path / "runs" / "P08" / "diagnosis.json").exists()


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ((), "--output"),
        (("--output", "runs", "--processes", 0), "--processes 0: at least one is needed"),
        (("--output", "runs", "--scheduler", "nowhere"), "nowhere"),
    ],
)
def test_what_cannot_be_done_is_one_line(
    capsys: pytest.CaptureFixture[str],
    cases: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[object, ...],
    complaint: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("estimator.cluster._PATIENCE_S", 0.5)
    status, out, err = run(capsys, "diagnose", cases, *arguments)
    assert (status, out) == (2, "")
    assert complaint in err.splitlines()[-1]


def test_options_of_a_folder_of_cases_are_refused_for_one_case(
    capsys: pytest.CaptureFixture[str], cases: Path
) -> None:
    status, _, err = run(capsys, "diagnose", cases / "P07", "--processes", 2)
    assert (status, err.count("\n")) == (2, 1)
    assert "--processes: is of a folder of cases" in err
