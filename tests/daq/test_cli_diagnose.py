"""The verbs ``diagnose`` and ``benchmark run|score``, with a stand-in for the diagnosis."""

import json
from collections.abc import Sequence
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
    if tell is not None:
        tell("fitting the baseline", 0, 1)
    return inclusion()


def refuses(
    experiments: Sequence[Experiment], tell: Progress | None, material: FitSettings | None = None
) -> Diagnosis:
    raise FitError("the data do not determine the parameters; add an experiment")


@pytest.fixture
def case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("daq.cli.diagnosis.diagnose.diagnose", stand_in)
    monkeypatch.setattr("daq.cli.estimation.benchmark.scoring.diagnose", stand_in)
    folder = tmp_path / "cases" / "P07"
    for order, name in enumerate(("pull", "twist"), start=1):
        write_experiment(small_experiment(name, order), folder / name)
    return folder


def run(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    status = main([str(argument) for argument in arguments])
    out, err = capsys.readouterr()
    return status, out, err


def test_diagnose_tells_the_verdict_first(capsys: pytest.CaptureFixture[str], case: Path) -> None:
    status, out, err = run(capsys, "diagnose", case)
    assert status == 0
    assert out.startswith("Inhomogeneity (93 %) causes the gap.\n")
    assert "What to do next:" in out
    assert err == "fitting the baseline\n"


def test_diagnose_prints_one_json_object_alone(capsys: pytest.CaptureFixture[str], case: Path) -> None:
    status, out, _ = run(capsys, "diagnose", case / "pull", "--json")
    assert status == 0
    assert json.loads(out)["verdict"] == ["inhomogeneity"]
    assert out.count("\n") == 1


def test_diagnose_writes_page_and_data(
    capsys: pytest.CaptureFixture[str], case: Path, tmp_path: Path
) -> None:
    status, out, _ = run(capsys, "diagnose", case, "--output", tmp_path / "runs" / "P07")
    assert status == 0
    assert out.endswith(f"Report: {tmp_path / 'runs' / 'P07' / 'diagnosis.html'}\n")
    assert "Inhomogeneity (93 %)" in (tmp_path / "runs" / "P07" / "diagnosis.html").read_text(
        encoding="utf-8"
    )
    data = json.loads((tmp_path / "runs" / "P07" / "diagnosis.json").read_text(encoding="utf-8"))
    assert data["where"]["radius"] == 0.0161


def test_a_case_that_is_not_there_and_a_diagnosis_that_fails_are_one_line(
    capsys: pytest.CaptureFixture[str], case: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    status, out, err = run(capsys, "diagnose", case / "nowhere")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "nowhere" in err
    monkeypatch.setattr("daq.cli.diagnosis.diagnose.diagnose", refuses)
    status, out, err = run(capsys, "diagnose", case)
    assert (status, out) == (2, "")
    assert err.startswith(
        "retract: the data do not determine the parameters; add an experiment; suspicious in "
    )
    assert err.count("\n") == 1


def test_a_set_of_cases_is_answered_and_scored(
    capsys: pytest.CaptureFixture[str], case: Path, tmp_path: Path
) -> None:
    cases = case.parent
    truth = 'effects = ["inhomogeneity"]\nyoungs_modulus = 26000.0\npoisson_ratio = 0.48\n'
    (case / "truth.toml").write_text(truth)
    status, out, _ = run(capsys, "benchmark", "run", cases)
    assert status == 0
    answers = tmp_path / "cases-answers"
    assert out == f"1 cases diagnosed, 0 had been; answers in {answers}\n"
    status, out, _ = run(
        capsys, "benchmark", "score", answers, cases, "--output", tmp_path / "score.html", "--json"
    )
    assert status == 0
    told = json.loads(out)
    assert told["metrics"]["single cause: top-1"]["value"] == 1.0
    assert told["openings"] == 1
    assert (tmp_path / "score.html").exists()
    status, out, _ = run(capsys, "benchmark", "score", answers, cases, "--also", answers, cases, "--json")
    assert status == 0
    assert json.loads(out)["cases"]["single cause"] == 2


def test_cases_that_cannot_be_diagnosed_are_told_and_the_status_says_so(
    capsys: pytest.CaptureFixture[str], case: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("daq.cli.estimation.benchmark.scoring.diagnose", refuses)
    status, out, _ = run(capsys, "benchmark", "run", case.parent)
    assert status == 1
    assert "no answer to P07: the data do not determine the parameters" in out


def test_a_wrong_name_for_the_score_is_refused_before_the_keys_are_opened(
    capsys: pytest.CaptureFixture[str], case: Path, tmp_path: Path
) -> None:
    status, _, err = run(capsys, "benchmark", "score", tmp_path, case.parent, "--output", "score.pdf")
    assert (status, err.count("\n")) == (2, 1)
    assert ".html or .png" in err
    assert not (case.parent / "openings.txt").exists()
