"""Scores by how far the catalogue knows the form of a cause: exactly, nearly, or not at all."""

import json
from pathlib import Path
from typing import Any

import pytest
from blind_scores import answer, key, scored, values

from estimator.blind.scoring.score import Score
from estimator.blind.scoring.telling import score_text, write_score


def of_family(truth: str, family: str, block: str = "") -> str:
    """A key that tells how far the catalogue knows the form, and the block of what has no label."""
    return "\n".join([truth, f"in_family = {json.dumps(family)}", *([f'block = "{block}"'] if block else [])])


def at_block(told: dict[str, Any], block: str) -> dict[str, Any]:
    """The answer with most of the probability on one block."""
    return {**told, "where": {**told["where"], "blocks": {block: 0.9, "anchor": 0.1}}}


@pytest.fixture
def families(tmp_path: Path) -> Score:
    """Causes of exact, near and far forms, some laid to the right block by a label or by something unknown."""
    slip, sure = {"gripper_slip": 0.95, "none": 0.05}, {"unknown": 0.97, "none": 0.03}
    named = at_block(answer(("gripper_slip",), slip), "grasp")
    cameras = at_block(answer(("unknown",), sure), "vision")
    return scored(
        tmp_path,
        {
            "exact": (of_family(key(["gripper_slip"], sigma=[9.0]), "exact"), named),
            "near": (of_family(key(["gripper_compliance"], sigma=[9.0]), "near"), named),
            "far": (of_family(key(["camera_scale"], sigma=[9.0]), "far"), cameras),
            "faint": (
                of_family(key(["camera_rotation"], sigma=[4.0]), "far"),
                at_block(answer((), slip), "vision"),
            ),
            "outside": (of_family(key(["unknown"]), "far", "vision"), cameras),
            "elsewhere": (of_family(key(["unknown"]), "far", "force"), cameras),
            "clean": (key([], ""), answer((), {"none": 0.9, "unknown": 0.1})),
        },
    )


def test_exact_near_and_far_forms_are_scored_apart(families: Score) -> None:
    found = {name: {m.name: m.figure for m in metrics} for name, metrics in families.by_family.items()}
    assert list(found) == ["exact", "near", "far"]
    asked = "of those from 6 σ on: "
    assert [found[family][f"{asked}top-1"].value for family in found] == [1.0, 0.0, 0.0]
    assert [found[family][f"{asked}right group"].value for family in found] == [1.0, 1.0, 0.0]
    assert [found[family]["wrong with more than 0.9"].value for family in found] == pytest.approx(
        [0, 1, 1 / 2]
    )
    assert found["far"]["wrong with more than 0.9, and of the block"].value == pytest.approx(1 / 4)
    assert found["near"]["calibration error (15 bins)"].value == pytest.approx(0.95)
    assert found["exact"]["rightly named: E within 3 %"].count == 1
    assert found["far"]["rightly named: E within 3 %"].count == 0


def test_something_unknown_counts_for_the_block_that_it_is_laid_to(families: Score) -> None:
    found = {metric.name: metric.figure for metric in families.by_family["far"]}
    assert found["of those from 6 σ on: right block"].value == 1.0
    # Without a verdict nobody is told where to look.
    assert found["single cause: right block"].value == pytest.approx(1 / 2)
    assert found["outside the catalogue: right block"].value == pytest.approx(1 / 2)
    assert values(families)["right block of the rig"].value == pytest.approx(3 / 4)


def test_the_families_are_told_in_words_and_as_values(families: Score, tmp_path: Path) -> None:
    text = score_text(families)
    assert "forms that the catalogue has not" in text
    told = json.loads(json.dumps(families.as_json(), allow_nan=False))["by_family"]
    assert told["far"]["single cause: right block"]["cases"] == 2
    write_score(families, tmp_path / "score.html", "Score")
    assert "forms that the catalogue has nearly" in (tmp_path / "score.html").read_text()


def test_of_several_causes_the_least_known_form_counts(tmp_path: Path) -> None:
    both = key(["gripper_slip", "force_bias"], sigma=[9.0, 9.0]) + '\nin_family = ["exact", "far"]'
    score = scored(tmp_path, {"both": (both, answer(("gripper_slip", "force_bias"), {"gripper_slip": 1.0}))})
    (metrics,) = score.by_family.values()
    assert {m.name: m.figure.value for m in metrics}["several causes: all named"] == 1.0
    assert list(score.by_family) == ["far"]
