"""``retract handover`` writes a folder that stands alone, and tells what it left out and what it did not run."""

import importlib.util
import json
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from daq.cli import main
from estimator import Experiment
from estimator.experiment import write_experiment
from estimator.fem.discretisation.block_mesh import Grading
from estimator.handover.calculix.engine import CalculiX
from estimator.handover.mujoco.engine import MuJoCo

COARSE = Grading(grasp_m=6e-3, anchor_m=10e-3, largest_m=20e-3, growth=3.0, layers=1)


@pytest.fixture
def case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A recorded pull, and the estimate and the diagnosis of it."""
    for engine in (CalculiX, MuJoCo):
        monkeypatch.setattr(engine, "grading", COARSE)
    planned = Experiment.of_block(np.linspace((0, 0, 0), (0.004, 0, 0), 3))
    write_experiment(replace(planned, wrench=planned.wrench - [0.5, 0, 0, 0, 0, 0]), tmp_path / "pull")
    material = {
        "youngs_modulus": {"value": 15e3, "std": 100.0},
        "poisson_ratio": {"value": 0.45, "std": 0.01},
    }
    estimate = {**material, "correlation": 0.1, "law": "neo_hookean", "shape": {}}
    gain = {"form": "fx", "parameters": {"gain": {"value": 0.25, "std": 0.01, "unit": "1"}}}
    relaxing = {
        "form": "one_term",
        "parameters": {
            "relaxing_share_1": {"value": 0.2, "std": 0.1},
            "relaxation_time_1": {"value": 3.0, "std": 1},
        },
    }
    diagnosis = {
        "verdict": ["force_axis_gain", "viscoelasticity"],
        "probabilities": {"force_axis_gain": 0.97, "none": 0.03},
        "effects": {"force_axis_gain": gain, "viscoelasticity": relaxing},
        "material": {"before": material, "after": material},
    }
    for name, told in (("estimate", estimate), ("diagnosis", diagnosis)):
        (tmp_path / f"{name}.json").write_text(json.dumps(told))
    return tmp_path


def handover(case: Path, *more: str, result: str = "diagnosis.json", to: str = "calculix") -> list[str]:
    source = ["--result", str(case / result), "--output", str(case / "out"), "--to", to]
    return ["handover", str(case / "pull"), *source, *more]


def module_at(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location("copied_sensors", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["copied_sensors"] = module
    spec.loader.exec_module(module)
    return module


def test_the_folder_holds_what_its_page_lists(case: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(handover(case, "--json", "--draws", "12")) == 0
    told = json.loads(capsys.readouterr().out)
    assert sorted(path.name for path in (case / "out").iterdir()) == sorted(told["files"])
    assert told["causes"] == ["force_axis_gain:fx"]
    assert list(told["left_out"]) == ["viscoelasticity:one_term"]
    page = (case / "out" / "README.md").read_text()
    assert all(f"`{name}`" in page for name in told["files"])
    assert "`viscoelasticity:one_term`" in page
    assert "was not run" in page
    assert len(json.loads((case / "out" / "draws.json").read_text())) == 12


def test_the_copied_wrapper_works_without_this_package(case: Path) -> None:
    assert main(handover(case)) == 0
    sensors = module_at(case / "out" / "sensors.py")
    told = json.loads((case / "out" / "sensors.json").read_text())
    beads = np.tile(told["stated_rest"]["pull"], (3, 1, 1))
    turns = np.tile(np.eye(3), (3, 1, 1))
    rows = sensors.Observations(np.arange(3.0), np.zeros((3, 3)), turns, np.ones((3, 6)), beads, beads[0])
    recorded = sensors.as_recorded(rows, told["experiments"]["pull"])
    np.testing.assert_allclose(recorded.wrench, np.tile([1.25, 1, 1, 1, 1, 1], (3, 1)))


def test_mujoco_gets_a_model_and_the_motion(case: Path) -> None:
    assert main(handover(case, to="mujoco", result="estimate.json")) == 0
    motion = np.loadtxt(case / "out" / "01_pull_motion.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(motion[:, 1], [0.04, 0.042, 0.044])
    assert (case / "out" / "phantom.xml").is_file()


@pytest.mark.parametrize("engine", [CalculiX, MuJoCo])
def test_an_engine_that_is_not_installed_is_told(
    engine: type[CalculiX] | type[MuJoCo], case: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engine, "missing", lambda self: "it was not found here")
    assert main(handover(case, "--verify", result="estimate.json", to=engine.__name__.lower())) == 0
    assert f"{engine.name} was not run: it was not found here." in (case / "out" / "README.md").read_text()


@pytest.mark.skipif(bool(CalculiX().missing()), reason="CalculiX is not installed: no ccx on the path")
def test_the_page_tells_how_the_engine_compares(case: Path) -> None:
    assert main(handover(case, "--verify", result="estimate.json")) == 0
    page = (case / "out" / "README.md").read_text()
    assert "CalculiX 2" in page
    assert "| pull " in page


@pytest.mark.parametrize(
    ("more", "complaint"),
    [
        (["--result", "nowhere.json"], "nowhere.json: cannot be read as JSON"),
        (["--draws", "1"], "--draws 1: there are 2 answers"),
        (["--output", "{case}"], "is there already; name a folder that is not"),
    ],
)
def test_bad_input_ends_with_one_line(
    more: list[str], complaint: str, case: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(handover(case, *(one.format(case=case) for one in more))) == 2
    complaints = [line for line in capsys.readouterr().err.splitlines() if line.startswith("retract:")]
    assert len(complaints) == 1
    assert complaint in complaints[0]
