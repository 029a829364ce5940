"""A score as a page, a picture, text and plain values."""

import json
from pathlib import Path

import pytest
from blind_scores import answer, key, mixed_score, scored

from estimator.blind.scoring.score import Score
from estimator.blind.scoring.telling import score_text, write_score


@pytest.fixture
def mixed(tmp_path: Path) -> Score:
    return mixed_score(tmp_path)


@pytest.mark.parametrize("suffix", ["html", "png"])
def test_a_score_is_a_page_or_a_picture(mixed: Score, tmp_path: Path, suffix: str) -> None:
    file = tmp_path / "made" / f"score.{suffix}"
    write_score(mixed, file, "Score of <these>")
    told = file.read_bytes()
    assert told.startswith(b"\x89PNG") if suffix == "png" else b"Score of &lt;these&gt;" in told
    if suffix == "html":
        assert b"outside the catalogue: recognised" in told
        assert b"Right as often as claimed" in told
        assert b"http:" not in told and b"https:" not in told


def test_pairs_alone_are_scored_without_what_single_answers_claim(tmp_path: Path) -> None:
    pair = key(["gripper_slip", "force_bias"])
    both = answer(("gripper_slip", "force_bias"), {"gripper_slip": 0.95, "none": 0.05})
    score = scored(tmp_path, {"a": (pair, both)})
    assert "claims" not in score_text(score)
    write_score(score, tmp_path / "score.png", "Pairs")
    write_score(score, tmp_path / "score.html", "Pairs")
    assert "Right as often as claimed" not in (tmp_path / "score.html").read_text(encoding="utf-8")


def test_a_score_is_plain_values_for_programs(mixed: Score) -> None:
    told = mixed.as_json()
    assert json.loads(json.dumps(told, allow_nan=False)) == told
    assert told["metrics"]["no gap: false alarms"]["cases"] == 2
    assert told["cases"] == {"no gap": 2, "single cause": 5, "outside the catalogue": 2, "several causes": 2}
