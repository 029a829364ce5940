"""Scores of sealed cases that are given by their keys and answers, for the tests of scoring."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from synthetic_diagnoses import diagnosis, inclusion

from estimator.blind.scoring.intervals import Figure
from estimator.blind.scoring.score import Score, score_answers
from estimator.diagnosis.conclusions.as_json import as_json


def key(effects: Sequence[str], level: str = "clear", sigma: Sequence[float] = (), **where: object) -> str:
    told = [f"effects = {json.dumps(list(effects))}", "youngs_modulus = 26000.0", "poisson_ratio = 0.48", ""]
    if where:
        told += ["[where]", *(f"{name} = {json.dumps(value)}" for name, value in where.items()), ""]
    told += ["[generator]", f"level = {json.dumps(level)}"]
    return "\n".join([*told, *([f"sigma = {list(sigma)}"] if sigma else [])])


def answer(verdict: tuple[str, ...], probabilities: dict[str, float], **changes: object) -> dict[str, Any]:
    return as_json(diagnosis(verdict, probabilities, **changes))  # type: ignore[arg-type]  # fields by name


def with_ceiling(told: dict[str, Any], **share: float) -> dict[str, Any]:
    """The answer with a ceiling of labels that is so high at 10 sigma and nothing at 1."""
    return {
        **told,
        "ceiling": {label: {"sigma": [1.0, 10.0], "share": [0.0, high]} for label, high in share.items()},
    }


def scored(folder: Path, cases: Mapping[str, tuple[str, dict[str, Any]]]) -> Score:
    """The score of cases given by key and answer."""
    (folder / "keys").mkdir(parents=True)
    (folder / "answers").mkdir()
    for name, (truth, told) in cases.items():
        (folder / "keys" / f"{name}.toml").write_text(truth)
        (folder / "answers" / f"{name}.json").write_text(json.dumps(told))
    return score_answers([(folder / "answers", folder / "keys")])


def values(score: Score) -> dict[str, Figure]:
    return {metric.name: metric.figure for metric in score.metrics}


def mixed_score(folder: Path) -> Score:
    """Five singles, two clean cases, two outside the catalogue, two doubles."""
    slip, bias = {"gripper_slip": 0.95, "none": 0.05}, {"force_bias": 0.6, "none": 0.3, "unknown": 0.1}
    region = as_json(inclusion())
    one_of_two = answer(("gripper_slip", "force_bias"), slip)
    return scored(
        folder,
        {
            "right": (key(["gripper_slip"]), answer(("gripper_slip",), slip)),
            "group": (key(["gripper_compliance"]), answer(("gripper_slip",), slip)),
            "third": (
                key(["force_drift"], "subtle"),
                answer((), {"none": 0.5, "unknown": 0.3, "force_drift": 0.2}),
            ),
            "place": (
                key(["inhomogeneity"], "clear", centre=[-0.0113, 0.0192, 0.003], radius=0.01),
                region,
            ),
            "spurious": (key(["gripper_slip"], "subtle"), one_of_two),
            "clean": (key([], ""), answer((), {"none": 0.9, "unknown": 0.1})),
            "alarm": (key([], ""), answer(("force_bias",), bias)),
            "outside": (key(["air_bubble"]), answer(("unknown",), {"unknown": 0.8, "none": 0.2})),
            "misled": (key(["unknown"]), answer(("gripper_slip",), slip)),
            "both": (key(["gripper_slip", "force_bias"], "clear and subtle"), one_of_two),
            "one": (key(["gripper_slip", "camera_scale"]), one_of_two),
        },
    )
