"""Anyone's answers: what the schema and the checks beside it say of valid and of malformed ones."""

import copy
import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from estimator.blind.making.effects.catalogue import FORMS
from estimator.blind.scoring.entries.entry import Entry, examine, read_entry
from estimator.blind.scoring.entries.schema import Fault, answers_schema, labels
from estimator.blind.sealing.commitment import read_commitment
from estimator.errors import InputError

CONFORMANCE = Path(__file__).resolve().parents[2] / "examples" / "challenge" / "conformance"
SET = read_commitment(CONFORMANCE / "cases")
WHOLE = json.loads((CONFORMANCE / "valid" / "whole.json").read_text())
EXPECTED = (CONFORMANCE / "invalid" / "expected.txt").read_text().splitlines()
INVALID = sorted((CONFORMANCE / "invalid").glob("*.json"))


def faults_of(file: Path) -> list[str]:
    try:
        _, faults = examine(file, SET)
    except InputError as error:
        return [str(error).removeprefix(f"{file}: ")]
    return [str(fault) for fault in faults]


def examined(told: object, folder: Path) -> tuple[Entry | None, list[Fault]]:
    (folder / "answers.json").write_text(json.dumps(told))
    return examine(folder / "answers.json", SET)


def test_the_schema_is_one_and_knows_every_label_that_a_key_may_have() -> None:
    Draft202012Validator.check_schema(answers_schema())
    assert set(labels()) == {*FORMS, "none", "unknown"}


@pytest.mark.parametrize("file", sorted((CONFORMANCE / "valid").glob("*.json")), ids=lambda file: file.stem)
def test_valid_answers_of_the_conformance_data_are_entered(file: Path) -> None:
    assert faults_of(file) == []
    assert len(read_entry(file).answers) == 8


@pytest.mark.parametrize("file", INVALID, ids=lambda file: file.stem)
def test_invalid_answers_of_the_conformance_data_have_the_faults_that_are_stated(file: Path) -> None:
    stated = [line.removeprefix(f"{file.name}: ") for line in EXPECTED if line.startswith(f"{file.name}: ")]
    assert stated
    assert faults_of(file) == stated


def test_the_page_says_how_many_faults_there_are() -> None:
    page = (CONFORMANCE.parents[2] / "docs" / "challenge.md").read_text()
    assert f"What it says to {len(INVALID)} faults" in page


def test_what_is_left_out_is_taken_from_the_probabilities() -> None:
    answers = read_entry(CONFORMANCE / "valid" / "whole.json").answers
    assert answers["case01"].verdict == ()
    assert answers["case02"].verdict == ("force_bias",)
    assert answers["case04"].block == "grasp"
    assert answers["case05"].blocks == {"force": pytest.approx(0.8)}
    assert answers["case07"].block == "force"
    assert answers["case05"].credible_set == ("force_drift", "force_bias", "none")


JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
)


def places(told: object, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Every place within JSON, the whole of it but for the root."""
    inner = told.items() if isinstance(told, dict) else enumerate(told) if isinstance(told, list) else ()
    found = [path] if path else []
    for name, value in inner:
        found += places(value, (*path, name))
    return found


PLACES = places(WHOLE)


@settings(max_examples=120, deadline=None)
@given(where=st.sampled_from(PLACES), value=JSON)
def test_whatever_stands_anywhere_is_either_entered_or_told_in_single_lines(
    tmp_path_factory: pytest.TempPathFactory, where: tuple[Any, ...], value: object
) -> None:
    told = copy.deepcopy(WHOLE)
    inner = told
    for name in where[:-1]:
        inner = inner[name]
    inner[where[-1]] = value
    entry, faults = examined(told, tmp_path_factory.mktemp("answers"))
    assert (entry is None) == bool(faults)
    assert all("\n" not in str(fault).strip() for fault in faults)
    assert all(fault.where and fault.what and fault.advice for fault in faults)


@pytest.mark.parametrize("seconds", ["1" + "0" * 400, "-1e400", "NaN", "[" * 700 + "]" * 700])
def test_what_no_program_can_reckon_with_is_told(tmp_path: Path, seconds: str) -> None:
    text = (
        (CONFORMANCE / "valid" / "minimal.json")
        .read_text()
        .replace('"seconds": 0', f'"seconds": {seconds}', 1)
    )
    (tmp_path / "answers.json").write_text(text)
    told = faults_of(tmp_path / "answers.json")
    assert told and all(line.startswith("answers.case01.seconds: ") for line in told)


@settings(max_examples=60, deadline=None)
@given(told=JSON)
def test_json_that_is_no_answers_is_told(tmp_path_factory: pytest.TempPathFactory, told: object) -> None:
    entry, faults = examined(told, tmp_path_factory.mktemp("answers"))
    assert entry is None and faults


@settings(max_examples=60, deadline=None)
@given(shares=st.lists(st.floats(0, 1), min_size=2, max_size=6))
def test_probabilities_must_add_up_to_one(
    tmp_path_factory: pytest.TempPathFactory, shares: list[float]
) -> None:
    told = copy.deepcopy(WHOLE)
    told["answers"]["case01"]["probabilities"] = dict(zip(labels(), shares, strict=False))
    _, faults = examined(told, tmp_path_factory.mktemp("answers"))
    assert bool(faults) == (abs(sum(shares) - 1) > 2e-3)


@pytest.mark.parametrize("name", ["probabilities", "seconds"])
@pytest.mark.parametrize("case", ["case01", "case08"])
def test_what_every_answer_needs_is_missed(tmp_path: Path, case: str, name: str) -> None:
    told = copy.deepcopy(WHOLE)
    del told["answers"][case][name]
    _, faults = examined(told, tmp_path)
    assert [str(fault) for fault in faults] == [f"answers.{case}: {name} is missing; add it"]


def test_a_file_with_faults_is_not_read_and_tells_the_first(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"too small.*first of 2 faults"):
        read_entry(CONFORMANCE / "invalid" / "two_faults.json")
