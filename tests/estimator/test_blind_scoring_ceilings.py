"""The share that could be named at all stands beside a score, where it is known of every case."""

from pathlib import Path

import pytest
from blind_scores import answer, key, scored, with_ceiling

from estimator.blind.scoring.telling import score_text


def test_the_ceiling_at_the_cases_own_sigma_stands_beside_the_score(tmp_path: Path) -> None:
    slip = with_ceiling(
        answer(("gripper_slip",), {"gripper_slip": 0.95, "none": 0.05}), gripper_slip=0.8, force_bias=0.6
    )
    far, near = key(["gripper_slip"], sigma=[40.0]), key(["force_bias"], sigma=[10.0**0.5])
    score = scored(tmp_path, {"a": (far, slip), "b": (near, slip)})
    top = next(metric for metric in score.metrics if metric.name == "single cause: top-1")
    assert top.ceiling == pytest.approx((0.8 + 0.3) / 2)
    line = next(line for line in score_text(score).splitlines() if line.startswith("single cause: top-1"))
    assert line.endswith("55.0 %")


def test_two_causes_are_named_no_oftener_than_the_one_that_is_harder_to_name(tmp_path: Path) -> None:
    told = with_ceiling(answer(("gripper_slip",), {"gripper_slip": 1.0}), gripper_slip=0.8, force_bias=0.6)
    both = key(["gripper_slip", "force_bias"], sigma=[10.0, 10.0**0.5])
    found = {metric.name: metric.ceiling for metric in scored(tmp_path, {"a": (both, told)}).metrics}
    assert found["several causes: all named"] == pytest.approx(0.3)
    assert found["several causes: at least one"] is None


def test_a_ceiling_that_is_known_of_only_some_cases_is_left_out(tmp_path: Path) -> None:
    told = with_ceiling(answer(("gripper_slip",), {"gripper_slip": 0.95, "none": 0.05}), gripper_slip=0.8)
    stated, silent = key(["gripper_slip"], sigma=[12.0]), key(["gripper_slip"])
    score = scored(tmp_path, {"a": (stated, told), "b": (silent, told)})
    assert {metric.ceiling for metric in score.metrics if "calibration" not in metric.name} == {None}
