"""The scripts of ``examples/`` that compute, in a reduced form; and the package there, installed as others are."""

import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from synthetic_diagnoses import inclusion

from estimator.api import diagnosing
from estimator.effects.catalogue import Catalogue, default_catalogue
from estimator.effects.effect import Effect
from estimator.materials import with_plugins
from estimator.plugins import Plugin

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
# without the finer mesh, which takes most of the time
QUICK = ["tare"]
COMMAND = "from daq.cli import main; sys.exit(main(sys.argv[1:]))"


@pytest.fixture
def example(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """One of the scripts, imported."""
    monkeypatch.syspath_prepend(EXAMPLES)
    return import_module(request.param)


def script(name: str) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("example", [name], indirect=True)


def test_every_script_says_what_it_is_for_and_has_a_test() -> None:
    tested = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("test_examples*.py"))
    scripts = sorted(EXAMPLES.glob("*.py"))
    assert len(scripts) == 6
    for path in scripts:
        assert f'script("{path.stem}")' in tested
        assert path.read_text(encoding="utf-8").startswith('"""')


@script("estimate_stiffness")
def test_the_stiffness_of_a_simulated_tissue_is_estimated(example: ModuleType, tmp_path: Path) -> None:
    measured = example.simulated(steps=2, mesh="coarse")
    assert example.main(measured, tmp_path / "estimate.png", nuisances=QUICK) == pytest.approx(15e3, rel=0.1)
    assert (tmp_path / "estimate.png").stat().st_size > 10_000


@script("own_law")
def test_a_law_of_one_s_own_explains_what_it_made_better_than_the_baseline(example: ModuleType) -> None:
    misfit = example.main(steps=2, mesh="coarse", nuisances=QUICK)
    assert misfit["demiray"] < misfit["neo_hookean"]


@script("own_law")
def test_it_is_a_law_that_a_package_may_bring(example: ModuleType) -> None:
    table = with_plugins({}, [Plugin("retract.materials", "demiray", "own 1.0", example.Demiray)])
    law, one, eps = table["demiray"], np.ones(1), 1e-6
    x = np.array([0.3])
    for a in (0.0, 1e-9, 0.7):
        shape = np.array([a])
        found, beyond = (law.derivatives(3 + x + step, 3 * one, one, shape) for step in (0.0, eps))
        assert (beyond.value - found.value) / eps == pytest.approx(found.first[0], rel=1e-5)
        assert (beyond.first[0] - found.first[0]) / eps == pytest.approx(found.second[0], rel=1e-4, abs=1e-6)
    assert law.derivatives(3 * one, 3 * one, one, np.array([0.7])).first[0] == pytest.approx(0.5)


@script("diagnose_case")
def test_a_case_is_diagnosed_and_its_causes_are_drawn(
    example: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    # what a diagnosis finds has tests of its own, which take minutes
    monkeypatch.setattr(
        diagnosing, "diagnose_experiments", lambda experiments, progress, **options: inclusion()
    )
    measured = example.simulated(steps=1, mesh="coarse")
    assert [(one.name, one.order) for one in measured] == [("pull", 1), ("turning_pull", 2)]
    assert example.main(measured, tmp_path / "causes.png") == ("inhomogeneity",)
    assert (tmp_path / "causes.png").exists()
    assert "inhomogeneity: 0.93" in capsys.readouterr().out


@script("own_effect")
def test_an_effect_of_one_s_own_acts_and_has_its_place_in_the_catalogue(example: ModuleType) -> None:
    assert example.main(steps=2, mesh="coarse") > 0.02
    catalogue: Catalogue = example.catalogue()
    assert catalogue.effects[-1].label == default_catalogue().effects[-1].label
    found = {effect.label: effect.stage for effect in catalogue.effects}
    assert found["tool_flex"] == "motion"


# ---- a package


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The folder into which the example package was installed, beside nothing else."""
    source = tmp_path_factory.mktemp("source") / "heated-jaws"
    left_behind = shutil.ignore_patterns("build", "*.egg-info", "__pycache__")
    left_behind = shutil.ignore_patterns("build", "*.egg-info", "__pycache__")
    shutil.copytree(EXAMPLES / "heated-jaws", source, ignore=left_behind)
    target = tmp_path_factory.mktemp("installed")
    options = ["--quiet", "--no-deps", "--no-index", "--no-build-isolation", "--disable-pip-version-check"]
    subprocess.run(
        [sys.executable, "-m", "pip", "install", *options, "--target", str(target), str(source)], check=True
    )
    return target


def told_with(target: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """What Python says with another folder of packages beside its own."""
    program = f"import sys; sys.path.insert(0, {str(target)!r}); " + arguments[0]
    return subprocess.run(
        [sys.executable, "-c", program, *arguments[1:]], cwd=ROOT, capture_output=True, text=True, check=False
    )


def test_an_installed_package_s_effect_can_be_simulated_and_is_one_of_those_that_a_diagnosis_ranks(
    installed: Path,
) -> None:
    told = told_with(installed, COMMAND, "simulate", "--effects")
    assert told.returncode == 0, told.stderr
    assert (
        "heated_jaws: it takes softening (usually 0.3), warming_time (s, usually 20), depth (m" in told.stdout
    )
    ranked = told_with(
        installed,
        "from estimator.effects.catalogue import CATALOGUE; from estimator.effects.standard import EFFECTS; "
        "print([effect.name for effect in CATALOGUE if effect not in EFFECTS], len(CATALOGUE) - len(EFFECTS))",
    )
    assert ranked.stdout.strip() == "['heated_jaws'] 1", ranked.stderr


def test_heat_softens_the_tissue_near_the_grasp_with_time(installed: Path) -> None:
    told = told_with(
        installed,
        "import numpy as np; from estimator import Experiment, simulate; "
        "way = np.array([[0, 0, 0]] + 3 * [[0.006, 0, 0]]); planned = Experiment.of_block(way); "
        "cold, hot = (simulate(planned, effects=acting, mesh='coarse')[0].wrench[1:, 0] for acting in "
        "([], ['heated_jaws=0.5,warming_time=2'])); print(*(hot / cold))",
    )
    lost = 1.0 - np.array([float(text) for text in told.stdout.split()])
    assert lost.shape == (3,), told.stderr
    assert lost / lost[-1] == pytest.approx(np.expm1([-0.5, -1.0, -1.5]) / np.expm1(-1.5), abs=0.05)
    assert 0.02 < lost[-1] < 0.5


def declared(folder: Path, group: str, name: str, value: str) -> None:
    """Have a package "own-lab 0.2" declare something, as an installer writes it."""
    metadata = folder / "own_lab-0.2.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(
        "Metadata-Version: 2.1\nName: own-lab\nVersion: 0.2\n", encoding="utf-8"
    )
    (metadata / "entry_points.txt").write_text(f"[{group}]\n{name} = {value}\n", encoding="utf-8")


def test_every_verb_that_takes_a_law_takes_that_of_an_installed_package(tmp_path: Path) -> None:
    shutil.copy(EXAMPLES / "own_law.py", tmp_path)
    declared(tmp_path, "retract.materials", "demiray", "own_law:Demiray")
    assert "demiray" in told_with(tmp_path, COMMAND, "simulate", "--help").stdout
    stretch = np.linspace(1.0, 1.4, 60)
    growth = np.exp(0.8 * (stretch**2 + 2 / stretch - 3))
    stress_kpa = 10.0 * growth * (stretch - stretch**-2)
    rows = [f"{a:.6f},{b:.6f}" for a, b in zip(stretch - 1, stress_kpa, strict=True)]
    facts = ["Specimen,A1", "Strain,crosshead travel", "Initial height (mm),20.0"]
    record = tmp_path / "record.csv"
    head = "Engineering strain (-),Engineering stress (kPa)"
    record.write_text("\n".join([*facts, head, *rows, ""]), encoding="utf-8")
    told = told_with(
        tmp_path, COMMAND, "uniaxial", str(record), "--law", "demiray", "--mode", "tension", "--json"
    )
    assert told.returncode == 0, told.stderr
    shape = json.loads(told.stdout)["laws"]["demiray"]["shape"]
    assert shape["a"]["value"] == pytest.approx(0.8, abs=0.02)


def test_a_broken_package_is_named_in_one_line(tmp_path: Path) -> None:
    declared(tmp_path, "retract.effects", "old", "no_such_module:EFFECT")
    told = told_with(tmp_path, COMMAND, "simulate", "--effects")
    assert told.returncode == 2
    assert told.stdout == ""
    assert told.stderr.startswith(
        "retract: package own-lab 0.2, entry point 'old' of retract.effects: cannot be"
    )
    assert len(told.stderr.splitlines()) == 1


def test_the_package_s_effect_keeps_what_it_declares(
    installed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(installed)
    effect: Effect = import_module("heated_jaws").HeatedJaws()
    assert Catalogue((effect,)).effects == (effect,)
    assert effect.acts_on_tissue
