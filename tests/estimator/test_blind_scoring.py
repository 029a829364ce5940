"""What is counted when answers to sealed cases are scored: names, places, materials, intervals, claims, time."""

from dataclasses import replace
from pathlib import Path

import pytest
from blind_scores import answer, key, mixed_score, scored, values
from synthetic_diagnoses import inclusion

from estimator.blind.scoring.score import Score
from estimator.blind.scoring.telling import score_text
from estimator.diagnosis.conclusions.as_json import as_json
from estimator.diagnosis.result import Material, Quantity


@pytest.fixture
def mixed(tmp_path: Path) -> Score:
    return mixed_score(tmp_path)


def test_names_are_scored_by_label_group_and_rank(mixed: Score) -> None:
    found = values(mixed)
    assert found["single cause: top-1"].value == pytest.approx(3 / 5)
    assert found["single cause: top-3"].value == pytest.approx(4 / 5)
    assert found["single cause: right group"].value == pytest.approx(4 / 5)
    assert found["single cause: some gap seen"].value == pytest.approx(4 / 5)
    assert found["single cause: a spurious second"].value == pytest.approx(1 / 5)


def test_causes_that_stand_out_plainly_are_also_scored_by_themselves(tmp_path: Path) -> None:
    slip = answer(("gripper_slip",), {"gripper_slip": 0.95, "none": 0.05})
    third = answer((), {"none": 0.5, "unknown": 0.3, "force_drift": 0.2})
    plain, missed, faint, unsaid = (
        key(["gripper_slip"], sigma=[6.0]),
        key(["force_drift"], sigma=[7.0]),
        key(["force_bias"], sigma=[5.9]),
        key(["force_bias"]),
    )
    found = values(
        scored(tmp_path, {"a": (plain, slip), "b": (missed, third), "c": (faint, slip), "d": (unsaid, slip)})
    )
    assert found["single cause: top-1"].count == 4
    for asked, share in (("top-1", 0.5), ("top-3", 1.0), ("right group", 0.5)):
        figure = found[f"of those from 6 σ on: {asked}"]
        assert (figure.value, figure.count) == (share, 2)


def test_alarms_unknowns_and_confident_errors_are_counted(mixed: Score) -> None:
    found = values(mixed)
    assert found["no gap: false alarms"].value == pytest.approx(1 / 2)
    assert found["outside the catalogue: recognised"].value == pytest.approx(1 / 2)
    assert found["outside the catalogue: confidently wrong"].value == pytest.approx(1 / 2)
    assert found["all cases: confidently wrong"].value == pytest.approx(2 / 11)


def test_doubles_are_scored_by_what_they_share_with_the_truth(mixed: Score) -> None:
    found = values(mixed)
    assert found["several causes: all named"].value == pytest.approx(1 / 2)
    assert found["several causes: at least one"].value == pytest.approx(1.0)
    assert found["several causes: a spurious one"].value == pytest.approx(1 / 2)


def test_place_block_closure_and_material_are_scored(mixed: Score) -> None:
    found = values(mixed)
    assert found["place error, median"].value == pytest.approx(5.0)
    assert found["local cause: a place is given"].count == 1
    # the stand-in says "anchor" unless it has found the inclusion
    assert found["right block of the rig"].value == pytest.approx(1 / 5)
    assert found["single cause: closure on held-out data, median"].value == pytest.approx(0.94)
    assert found["rightly named: error of E before, median"].value == pytest.approx(1900 / 26_000)
    assert found["rightly named: E within 3 % after"].value == pytest.approx(1.0)
    assert found["rightly named: error of ν before, median"].value == pytest.approx(0.049)
    assert found["rightly named: error of ν after, median"].value == pytest.approx(0.002)
    # 26.05 kPa ± 0.18 where 26 is true, and 0.482 ± 0.003 where 0.48 is
    assert found["one cause or none: E in its 95 % interval"].count == 7
    assert found["one cause or none: ν in its 95 % interval"].value == pytest.approx(1.0)


def test_a_local_cause_without_a_place_counts_as_none_given(tmp_path: Path) -> None:
    told = as_json(replace(inclusion(), where=replace(inclusion().where, centre=None)))
    found = values(scored(tmp_path, {"a": (key(["inhomogeneity"], centre=[0.0, 0.0, 0.0]), told)}))
    assert found["local cause: a place is given"].value == 0.0
    assert found["place error, median"].count == 0


def test_an_interval_that_misses_the_truth_counts_against_the_diagnosis(tmp_path: Path) -> None:
    sure = Material(Quantity(25_000.0, 100.0, "Pa"), Quantity(0.47, 0.02, "1"))
    told = answer(("gripper_slip",), {"gripper_slip": 1.0}, after=sure)
    found = values(scored(tmp_path, {"a": (key(["gripper_slip"]), told)}))
    assert found["one cause or none: E in its 95 % interval"].value == 0.0
    assert found["one cause or none: ν in its 95 % interval"].value == 1.0


def test_the_usual_time_of_a_diagnosis_is_told_and_the_longest(tmp_path: Path) -> None:
    told = answer((), {"none": 1.0})
    cases = {str(n): (key([], ""), {**told, "seconds": n}) for n in (20.0, 30.0, 110.0)}
    found = values(scored(tmp_path, cases))
    assert found["time of a diagnosis, median"].value == pytest.approx(30.0)
    assert found["time of a diagnosis, the slowest"].value == pytest.approx(110.0)


def test_single_causes_are_also_scored_by_level(mixed: Score) -> None:
    top = {level: found[0].figure for level, found in mixed.by_level.items()}
    assert {level: (figure.value, figure.count) for level, figure in top.items()} == {
        "clear": (pytest.approx(2 / 3), 3),
        "subtle": (0.5, 2),
    }


def test_confusion_counts_every_case_with_one_answer(mixed: Score) -> None:
    names, counts = mixed.labels.names, mixed.labels.counts
    assert counts.sum() == 9
    assert counts[names.index("gripper_compliance"), names.index("gripper_slip")] == 1
    assert counts[names.index("none"), names.index("force_bias")] == 1
    groups = mixed.groups
    assert groups.counts[groups.names.index("grasp"), groups.names.index("grasp")] == 3


def test_answers_are_scored_by_what_they_claim(mixed: Score) -> None:
    told = {(one["from"], one["to"]): (one["cases"], one["value"]) for one in mixed.as_json()["by_claim"]}
    assert sum(cases for cases, _ in told.values()) == 9
    assert told[0.5, 0.7] == (2, 0.0)
    assert "an answer that claims" in score_text(mixed)
