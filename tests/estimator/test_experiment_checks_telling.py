"""How `retract check` tells its findings: lines, JSON, exit status, and beside a failure."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from checked_experiments import GOOD, written
from spoiled_experiments import column, hung, wrench

from daq.cli import main
from estimator.errors import EstimatorError, FitError, SolverError
from estimator.experiment_checks import check_folder
from estimator.experiment_checks.suspicions import naming_suspicions
from estimator.experiment_checks.telling import as_text


def test_the_command_tells_each_finding_in_a_line_and_by_its_status(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = written(GOOD, tmp_path / "pull")
    assert main(["check", str(folder)]) == 0
    assert capsys.readouterr().out.startswith("fine")
    table = folder / "observations.csv"
    lines = table.read_text(encoding="utf-8").splitlines()
    table.write_text("\n".join([*lines[:10], lines[9], *lines[10:]]), encoding="utf-8")
    assert main(["check", str(folder)]) == 2
    said = capsys.readouterr().out.splitlines()
    assert any(
        "observations.csv, line 11, column time: the same time as in the row before" in line for line in said
    )
    assert main(["check", str(folder), "--json"]) == 2
    told = json.loads(capsys.readouterr().out)
    assert told["wrong"]
    assert {(f["file"], f["line"]) for f in told["folders"][0]["findings"]} == {("observations.csv", 11)}


def test_what_is_suspicious_ends_with_status_0(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = written(wrench(lambda w: column(w, np.s_[:, 1], lambda _: 0.0))(GOOD), tmp_path / "pull")
    assert main(["check", str(folder)]) == 0
    assert capsys.readouterr().out.startswith("suspicious")


@pytest.mark.parametrize("error", [FitError, SolverError])
def test_what_is_suspicious_is_said_with_a_failure_that_it_may_have_caused(
    error: type[EstimatorError], tmp_path: Path
) -> None:
    good, spoiled = written(GOOD, tmp_path / "good"), written(hung(GOOD), tmp_path / "hung")
    with pytest.raises(error, match=r"^it fails$"), naming_suspicions([good]):
        raise error("it fails")
    with (
        pytest.raises(error, match=r"it fails; suspicious in .*driven: the forces are"),
        naming_suspicions([spoiled]),
    ):
        raise error("it fails")


@pytest.mark.parametrize(
    ("file", "old", "new", "place"),
    [
        ("experiment.toml", "size = [0.06", "size = [60.0", "experiment.toml [phantom] size"),
        ("experiment.toml", "[sensor]", "[sensors]", "experiment.toml: [sensor] force_std"),
        ("observations.csv", "ramp", "rmap", "observations.csv, line 2, column phase"),
        ("observations.csv", "hold", "12", "observations.csv, line 2, column phase"),
    ],
)
def test_a_folder_that_cannot_be_read_has_that_as_its_finding(
    tmp_path: Path, file: str, old: str, new: str, place: str
) -> None:
    folder = written(
        replace(GOOD, phase=("ramp" if old == "ramp" else "hold",) * len(GOOD.time)), tmp_path / "pull"
    )
    content = (folder / file).read_text(encoding="utf-8")
    (folder / file).write_text(content.replace(old, new), encoding="utf-8")
    (checked,) = check_folder(folder)
    assert checked.wrong
    assert place in as_text([checked])
