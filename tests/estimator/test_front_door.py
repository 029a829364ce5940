"""The names that a script imports from ``estimator``: quick to import, documented by examples that run."""

import doctest
import json
import subprocess
import sys
import types
from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from synthetic_diagnoses import inclusion, small_experiment
from synthetic_estimates import estimate_of, made_up_budget, pull_fit

import estimator
from daq.cli import main
from estimator.api import diagnosing, estimating
from estimator.api.diagnosing import Diagnosis
from estimator.api.estimating import Estimate
from estimator.api.experiments import Experiment
from estimator.api.tables import dataframe
from estimator.diagnosis import result
from estimator.errors import InputError
from estimator.experiment import model, read_experiment, write_experiment
from estimator.fit.settings import FitSettings

NAMES = estimator.__all__


class Frame:
    """Stands in for a table of pandas, which tests do not need."""

    def __init__(self, columns: dict[str, Sequence[object]]) -> None:
        self.columns, self.index = columns, ""

    def set_index(self, index: str) -> "Frame":
        self.index = index
        return self


@pytest.fixture
def pandas(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", types.SimpleNamespace(DataFrame=Frame))


@pytest.fixture
def no_pandas(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)


@pytest.fixture
def experiment() -> Experiment:
    return Experiment.of(small_experiment())


@pytest.fixture
def estimate() -> Estimate:
    found = estimate_of(pull_fit(), pull_fit("twist"))
    return Estimate(**{name: getattr(found, name) for name in found.__dataclass_fields__})


@pytest.fixture
def diagnosis() -> Diagnosis:
    return Diagnosis.of(inclusion())


def test_importing_the_package_loads_nothing_of_it() -> None:
    program = (
        "import sys, estimator; print(len([name for name in sys.modules if name.startswith('estimator.')]))"
    )
    told = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "0"
    assert set(NAMES) == set(dir(estimator))


@pytest.mark.parametrize("name", NAMES)
def test_every_name_has_a_docstring_with_an_example_that_runs(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # a diagnosis takes minutes; what is shown of it does not
    monkeypatch.setattr(
        diagnosing, "diagnose_experiments", lambda experiments, progress, **options: inclusion()
    )
    documented = getattr(estimator, name)
    module = import_module(documented.__module__)
    (example,) = doctest.DocTestFinder(recurse=False).find(
        documented, name, module=module, globs={"tmp_path": tmp_path}
    )
    assert example.examples
    said: list[str] = []
    doctest.DocTestRunner().run(example, out=said.append)
    assert "".join(said) == ""


def test_the_example_of_the_package_runs() -> None:
    assert doctest.testmod(estimator).failed == 0


def test_what_the_page_on_scripts_shows_is_what_happens(tmp_path: Path) -> None:
    page = Path(__file__).resolve().parents[2] / "docs" / "extend-scripts.md"
    told = doctest.testfile(str(page), module_relative=False, globs={"folder": tmp_path}, encoding="utf-8")
    assert (told.failed, told.attempted > 5) == (0, True)
    text = page.read_text(encoding="utf-8")
    assert [name for name in NAMES if f"`{name}`" not in text] == []


def test_a_name_that_is_not_there_is_told() -> None:
    with pytest.raises(AttributeError, match="'estimator' has no attribute 'simulated'"):
        _ = estimator.simulated  # type: ignore[attr-defined]


# ---- experiments


def test_an_experiment_that_shows_itself_is_the_one_that_was_read(tmp_path: Path) -> None:
    folder = write_experiment(small_experiment(), tmp_path / "pull").path
    assert folder is not None
    plain, shown = read_experiment(folder), estimator.read_experiment(folder)
    assert isinstance(shown, model.Experiment)
    for name in ("position", "wrench", "fiducials", "time"):
        assert np.array_equal(getattr(plain, name), getattr(shown, name), equal_nan=True)
    assert isinstance(replace(shown, name="other"), Experiment)
    assert repr(shown).startswith(
        "<Experiment 'pull' of 'P07 <soft>': 25 rows in 36 s, the gripper goes 12.0 mm"
    )


def test_a_table_of_an_experiment_has_the_columns_of_its_file(
    pandas: None, experiment: Experiment, tmp_path: Path
) -> None:
    folder = write_experiment(experiment, tmp_path / "pull").path
    assert folder is not None
    header = (folder / "observations.csv").read_text(encoding="utf-8").splitlines()[0].split(",")
    frame = experiment.to_dataframe()
    assert list(frame.columns) == header
    assert frame.index == "time"
    assert list(experiment.to_dict()["observations"]) == header
    json.dumps(experiment.to_dict(), allow_nan=False)


def test_what_was_not_measured_is_null(experiment: Experiment) -> None:
    blind = replace(experiment, wrench=np.full_like(experiment.wrench, np.nan))
    assert set(blind.to_dict()["observations"]["fx"]) == {None}


@pytest.mark.parametrize(
    ("way", "turn", "complaint"),
    [
        ([(0, 0, 0)], None, "has 1 rows"),
        ([(0.001, 0, 0), (0, 0, 0)], None, "the first of them zero: at rest"),
        ([(0, 0, 0), (0.001, 0, 0)], [(0, 0, 0)], "displacement_m has 2 rows and turn_rad 1"),
        ([0, 0.001], None, "displacement_m has the shape"),
        ([(0, 0, 0), (float("nan"), 0, 0)], None, "three finite numbers"),
    ],
)
def test_a_motion_that_cannot_be_is_refused(way: object, turn: object, complaint: str) -> None:
    with pytest.raises(InputError, match=complaint):
        Experiment.of_block(way, turn)  # type: ignore[arg-type]


# ---- results


def test_an_estimate_is_the_object_that_the_command_prints(
    estimate: Estimate, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("daq.cli.estimation.estimate.estimate", lambda experiments, tell, settings: estimate)
    folder = write_experiment(small_experiment(), tmp_path / "pull").path
    assert main(["estimate", str(folder), "--json"]) == 0
    # the command reads the phantom's surface, and tells what was repaired of it, and what the checks say of the folder
    told = json.loads(capsys.readouterr().out)
    assert told.pop("suspicious")
    assert told == {**json.loads(json.dumps(estimate.to_dict())), "surface": []}


def test_a_diagnosis_is_the_object_that_the_command_prints(
    diagnosis: Diagnosis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("daq.cli.diagnosis.diagnose.diagnose", lambda experiments, tell, **known: inclusion())
    folder = write_experiment(small_experiment(), tmp_path / "pull").path
    assert main(["diagnose", str(folder), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told.pop("suspicious")
    assert told == {**diagnosis.to_dict(), "law": "neo_hookean", "surface": []}


def test_results_are_tables(pandas: None, estimate: Estimate, diagnosis: Diagnosis) -> None:
    parameters = estimate.to_dataframe()
    assert parameters.index == "parameter"
    assert parameters.columns["parameter"] == ["youngs_modulus", "poisson_ratio"]
    assert parameters.columns["std"] == [120.0, 0.0021]
    effects = diagnosis.to_dataframe()
    assert effects.columns["effect"][0] == diagnosis.verdict[0]
    assert set(effects.columns["effect"]) == set(diagnosis.effects)
    assert list(effects.columns["probability"]) == sorted(effects.columns["probability"], reverse=True)


def test_without_pandas_one_line_says_what_to_do(no_pandas: None) -> None:
    with pytest.raises(
        InputError, match="needs pandas, which is not installed; run pip install pandas, or take to_d"
    ):
        dataframe({"one": [1]})


def test_pandas_itself_takes_what_it_is_given() -> None:
    pytest.importorskip("pandas")
    frame = dataframe({"effect": ["a", "b"], "probability": [0.9, 0.1]}, index="effect")
    assert frame.loc["a", "probability"] == 0.9


ESTIMATE_KINDS = ("wrench", "fiducials", "body", "convergence")
DIAGNOSIS_KINDS = ("causes", "gap", "where", "map", "wrench", "residuals")


@pytest.mark.parametrize("kind", ESTIMATE_KINDS)
def test_an_estimate_draws_every_figure_of_its_report(kind: str, estimate: Estimate) -> None:
    figure = estimate.plot(kind, experiment=1)
    assert isinstance(figure, Figure)
    assert figure.axes
    assert "</svg>" in figure._repr_svg_()


def test_an_estimate_draws_its_budget_where_it_has_one(estimate: Estimate) -> None:
    with pytest.raises(InputError, match="no picture is called 'budget'"):
        estimate.plot("budget")
    assert len(replace(estimate, budget=made_up_budget()).plot("budget").axes) == 2


@pytest.mark.parametrize("kind", DIAGNOSIS_KINDS)
def test_a_diagnosis_draws_every_figure_of_its_report(kind: str, diagnosis: Diagnosis) -> None:
    assert diagnosis.plot(kind).axes


def test_an_experiment_draws_itself(experiment: Experiment) -> None:
    assert [axes.get_title(loc="left") or axes.get_title() for axes in experiment.plot().axes] == [
        "displacement, mm",
        "force, N",
        "torque, mN·m",
    ]


def test_a_figure_that_is_not_there_is_told_with_those_that_are(
    estimate: Estimate, diagnosis: Diagnosis
) -> None:
    with pytest.raises(InputError, match=f"choose one of {', '.join(ESTIMATE_KINDS)}"):
        estimate.plot("pie")
    with pytest.raises(InputError, match=f"choose one of {', '.join(DIAGNOSIS_KINDS)}"):
        diagnosis.plot("pie")


def test_a_notebook_shows_results_and_escapes_what_names_say(
    experiment: Experiment, estimate: Estimate, diagnosis: Diagnosis
) -> None:
    assert "P07 &lt;soft&gt;" in experiment._repr_html_()
    assert "E = " in estimate._repr_html_()
    assert "<table" in diagnosis._repr_html_()
    assert repr(estimate).startswith("<Estimate E = ")
    assert repr(diagnosis) == "<Diagnosis: Inhomogeneity (93 %) causes the gap.>"
    for one in (experiment, estimate, diagnosis):
        assert len(repr(one).splitlines()) == 1


def test_what_an_estimation_is_asked_for_reaches_the_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[FitSettings] = []

    def fit(experiments: object, progress: object, settings: FitSettings) -> result.Diagnosis:
        asked.append(settings)
        return estimate_of(pull_fit())

    monkeypatch.setattr(estimating, "fit_experiments", fit)
    estimator.estimate(
        small_experiment(),
        law="yeoh2",
        fixed={"c2": 0.1},
        priors={"youngs_modulus": (15e3, 2e3)},
        bounds={"poisson_ratio": (0.4, 0.49)},
        loss="huber",
        nuisances=["tare"],
        profile=True,
        budget={"force_gain": 0.005},
    )
    (settings,) = asked
    assert settings.budget is not None
    assert settings.budget.sizes == {"force_gain": 0.005}
    assert (settings.law.name, settings.fixed, settings.nuisances) == ("yeoh2", {"c2": 0.1}, {"tare"})
    assert settings.priors["youngs_modulus"].std == 2e3
    assert (settings.loss.name, settings.intervals) == ("huber", "profile")
