"""The two entries that are not ours: they run where this project cannot be imported, and what they write is valid."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from estimator.blind.scoring.entries.entry import examine
from estimator.blind.sealing.commitment import read_commitment

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "examples" / "challenge"
CASES = FOLDER / "conformance" / "cases"
KEYS = FOLDER / "conformance" / "keys"

# Whoever imports one of this project's packages fails, wherever it may be installed.
ALONE = """
import runpy, sys
class Refusing:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("daq", "estimator", "gui", "robot_drivers", "benchmarks"):
            raise ImportError(f"{name} belongs to the project")
sys.meta_path.insert(0, Refusing())
sys.path.insert(0, sys.argv[1])
sys.argv = sys.argv[2:]
runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
"""


def run(module: str, *arguments: object, status: int = 0) -> str:
    """Run a module of the baselines where nothing of this project can be imported."""
    command = [sys.executable, "-P", "-c", ALONE, str(FOLDER), module, *map(str, arguments)]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=120, env=environment)
    assert done.returncode == status, done.stderr
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def readings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The readings of the conformance cases."""
    file = tmp_path_factory.mktemp("readings") / "readings.json"
    assert "8 cases read" in run("challenge_baselines.readings_file", CASES, "--out", file)
    return file


def test_the_project_is_out_of_reach() -> None:
    assert "belongs to the project" in run("estimator.experiment", status=1)


def test_thresholds_answer_a_set_from_its_files_alone(readings: Path, tmp_path: Path) -> None:
    out = tmp_path / "answers.json"
    run("challenge_baselines.thresholds", CASES, readings, "--opened", readings, KEYS, "--out", out)
    entry, faults = examine(out, read_commitment(CASES))
    assert faults == [] and entry is not None
    assert all(answer.seconds > 0 and answer.youngs_modulus for answer in entry.answers.values())


def test_what_no_clean_case_shows_is_named(readings: Path, tmp_path: Path) -> None:
    told = json.loads(readings.read_text())
    for name in told:
        told[name]["reading"]["gains"] = dict.fromkeys(told["case01"]["reading"]["gains"], 1.0)
        told[name]["reading"]["misfits"] = [1.0, 1.0, 1.0]
        told[name]["reading"]["oddest_bead"] = [0.1, 0.1]
    told["case03"]["reading"]["gains"]["gripper_slip"] = 50.0
    changed = tmp_path / "readings.json"
    changed.write_text(json.dumps(told))
    run(
        "challenge_baselines.thresholds",
        CASES,
        changed,
        "--opened",
        changed,
        KEYS,
        "--out",
        tmp_path / "a.json",
    )
    entry, _ = examine(tmp_path / "a.json", read_commitment(CASES))
    assert entry is not None
    slip = {name: answer.probabilities["gripper_slip"] for name, answer in entry.answers.items()}
    assert max(slip, key=lambda name: slip[name]) == "case03"


def test_the_classifier_learns_and_answers(readings: Path, tmp_path: Path) -> None:
    random = np.random.default_rng(1)
    plain = json.loads(readings.read_text())["case01"]
    opened, keys = {}, tmp_path / "keys"
    keys.mkdir()
    labels = ["none", "gripper_slip", "force_drift"]
    for number in range(60):
        label, name = labels[number % 3], f"case{number:03d}"
        gains = {one: float(np.exp(random.normal())) for one in plain["reading"]["gains"]}
        gains |= {label: 1e6} if label != "none" else {}
        opened[name] = {**plain, "reading": {**plain["reading"], "gains": gains}}
        effects = [] if label == "none" else [label]
        (keys / f"{name}.toml").write_text(
            f"effects = {json.dumps(effects)}\nyoungs_modulus = 15000.0\npoisson_ratio = 0.45\n"
        )
    (tmp_path / "opened.json").write_text(json.dumps(opened))
    own = json.loads(readings.read_text())
    own["case05"] = opened["case002"]
    (tmp_path / "own.json").write_text(json.dumps(own))
    out = tmp_path / "answers.json"
    said = run(
        "challenge_baselines.classifier", CASES, tmp_path / "own.json",
        "--opened", tmp_path / "opened.json", keys, "--out", out,
    )  # fmt: skip
    assert "log score by cross-validation" in said
    entry, faults = examine(out, read_commitment(CASES))
    assert faults == [] and entry is not None
    assert entry.answers["case05"].verdict == ("force_drift",)
