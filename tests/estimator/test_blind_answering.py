"""Answering sealed cases without their keys, with a stand-in for the diagnosis."""

import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import pytest
from new_threads import new_threads
from synthetic_diagnoses import inclusion, no_gap, small_experiment

from estimator.blind.scoring.running import answer_cases
from estimator.diagnosis.result import Diagnosis
from estimator.errors import FitError, InputError
from estimator.experiment import Experiment, write_experiment
from estimator.workers import worker_pool


def stand_in(experiments: Sequence[Experiment], tell: Callable[[str, int, int], None] | None) -> Diagnosis:
    """Name the inclusion where the first experiment is a pull, otherwise nothing; refuse a tangent."""
    if experiments[0].name == "tangent":
        raise FitError("the data do not determine the parameters")
    return inclusion() if experiments[0].name == "pull" else no_gap()


def make_cases(folder: Path, names: Mapping[str, str]) -> Path:
    """A folder of cases, each with one experiment of the given name, and with a key that is no key."""
    for case, name in names.items():
        write_experiment(small_experiment(name), folder / case / name)
        (folder / case / "truth.toml").write_text("this is no TOML and must not be read")
    return folder


def test_an_answer_that_was_run_holds_the_ceiling_of_what_it_looked_for(tmp_path: Path) -> None:
    cases = make_cases(tmp_path / "cases", {"a": "pull"})
    answer_cases(stand_in, cases, tmp_path / "answers")
    told = json.loads((tmp_path / "answers" / "a.json").read_text())["ceiling"]
    assert set(told) == set(inclusion().rivals.labels)


def test_cases_are_answered_without_their_keys_and_only_once(tmp_path: Path) -> None:
    cases = make_cases(tmp_path / "cases", {"a": "pull", "b": "twist", "c": "tangent"})
    heard: list[tuple[str, int, int]] = []
    done = answer_cases(stand_in, cases, tmp_path / "answers", progress=lambda *told: heard.append(told))
    assert (done.done, done.present) == (("a", "b"), ())
    assert done.failed == {"c": "the data do not determine the parameters"}
    assert heard[-1] == ("diagnosed c", 3, 3)
    assert json.loads((tmp_path / "answers" / "a.json").read_text())["verdict"] == ["inhomogeneity"]
    again = answer_cases(stand_in, cases, tmp_path / "answers")
    assert (again.done, again.present, list(again.failed)) == ((), ("a", "b"), ["c"])


def test_a_case_that_cannot_be_read_is_told_before_any_is_diagnosed(tmp_path: Path) -> None:
    cases = make_cases(tmp_path / "cases", {"a": "pull", "b": "twist"})
    (experiment,) = (cases / "b").glob("*/experiment.toml")
    experiment.write_text("format = 3", encoding="utf-8")
    with pytest.raises(InputError, match=r"experiment\.toml"):
        answer_cases(stand_in, cases, tmp_path / "answers")
    assert not (tmp_path / "answers").exists()


def test_several_cases_are_answered_at_a_time(tmp_path: Path) -> None:
    cases = make_cases(tmp_path / "cases", {"a": "pull", "b": "twist"})
    new = new_threads()
    done = answer_cases(stand_in, cases, tmp_path / "answers", workers=partial(worker_pool, 2))
    assert done.done == ("a", "b")
    assert new() == 0


def test_a_folder_without_cases_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no case"):
        answer_cases(stand_in, tmp_path, tmp_path / "answers")
