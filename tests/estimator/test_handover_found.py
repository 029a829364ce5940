"""What a result holds is read as it stands, and drawn from with the weights of its answers."""

import csv
import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from handover_cases import found_with, tissue

from estimator import Experiment
from estimator.effects.catalogue import default_catalogue
from estimator.errors import InputError
from estimator.handover.draws import draw, write_draws
from estimator.handover.found import Answer, Found
from estimator.handover.reading import found_of, read_found


def quantity(value: float, std: float) -> dict[str, Any]:
    return {"value": value, "std": std, "unit": "1"}


MATERIAL = {"youngs_modulus": quantity(15e3, 200.0), "poisson_ratio": quantity(0.45, 0.01)}
ALONE = {"youngs_modulus": quantity(14e3, 200.0), "poisson_ratio": quantity(0.44, 0.01)}


def a_diagnosis(**more: object) -> dict[str, Any]:
    effects = {
        "force_axis_gain": {"form": "fx", "parameters": {"gain": quantity(0.2, 0.01)}},
        "camera_scale": {
            "form": "uniform",
            "parameters": {"scale_error": quantity(0.0, 0.1)},
            "alone": {"parameters": {"scale_error": quantity(0.02, 0.001)}, "material": ALONE},
        },
    }
    return {
        "verdict": ["force_axis_gain"],
        "probabilities": {"force_axis_gain": 0.9, "camera_scale": 0.06, "none": 0.035, "unknown": 0.005},
        "effects": effects,
        "material": {"before": ALONE, "after": MATERIAL},
        **more,
    }


def test_answers_of_a_diagnosis_are_its_verdict_and_what_else_is_probable() -> None:
    found = found_of(a_diagnosis())
    assert [answer.label for answer in found.answers] == ["force_axis_gain", "camera_scale", "none"]
    (cause,) = found.verdict.causes
    assert (cause.effect.name, cause.values, cause.deviations) == (
        "force_axis_gain:fx",
        {"gain": 0.2},
        {"gain": 0.01},
    )
    (alone,) = found.answers[1].causes
    assert alone.values == {"scale_error": 0.02}
    assert found.answers[1].tissue.youngs_modulus.value == 14e3


def test_an_estimate_is_an_answer_without_a_cause() -> None:
    told = {**MATERIAL, "correlation": -0.4, "law": "ogden1", "shape": {"exponent": quantity(3.0, 0.1)}}
    found = found_of(told)
    assert (found.law, found.shape, found.verdict.causes) == ("ogden1", (3.0,), ())
    assert found.verdict.tissue.correlation == -0.4


@pytest.mark.parametrize(
    ("told", "complaint"),
    [
        ({}, "no result of an estimation or a diagnosis"),
        ({"mesh": {}}, "no result of an estimation or a diagnosis"),
        ([], "no result of an estimation or a diagnosis"),
        ({**MATERIAL, "law": "jelly", "shape": {}}, "no law is called 'jelly'"),
        ({**MATERIAL, "law": "yeoh2", "shape": {}}, "no whole result"),
        (a_diagnosis(law="yeoh2"), "whose shape a diagnosis does not tell"),
        (a_diagnosis(material={}), "no whole result"),
    ],
)
def test_what_is_no_result_ends_with_one_line(told: object, complaint: str, tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    path.write_text(json.dumps(told))
    with pytest.raises(InputError, match=complaint) as raised:
        read_found(path)
    assert str(path) in str(raised.value)
    assert "\n" not in str(raised.value)


def test_a_cause_that_cannot_be_made_is_noted_by_its_name() -> None:
    told = a_diagnosis()
    effects: Mapping[str, Any] = {"force_axis_gain": {"form": "fx", "parameters": {}}}
    found = found_of({**told, "effects": effects, "verdict": ["force_axis_gain", "unknown"]})
    assert found.verdict.causes == ()
    assert [note.split(":")[0] for note in found.notes] == ["force_axis_gain", "unknown", "camera_scale"]


@pytest.mark.parametrize("count", [3, 10, 500])
def test_weights_add_up_to_the_probabilities(count: int) -> None:
    found = found_of(a_diagnosis())
    draws = draw(found, count, seed=4)
    assert len(draws) == count
    total = sum(answer.probability for answer in found.answers)
    for answer in found.answers:
        weight = sum(one.weight for one in draws if one.answer == answer.label)
        assert weight == pytest.approx(answer.probability / total)


def test_draws_have_the_moments_that_were_found() -> None:
    found = Found("neo_hookean", (), (Answer("none", 1.0, (), tissue(0.4, correlation=-0.7)),))
    draws = draw(found, 4000, seed=1)
    sample = np.array([(one.youngs_modulus, one.poisson_ratio) for one in draws])
    np.testing.assert_allclose(sample.mean(axis=0), [15e3, 0.4], rtol=2e-3)
    np.testing.assert_allclose(sample.std(axis=0), [200.0, 0.01], rtol=0.05)
    assert np.corrcoef(sample.T)[0, 1] == pytest.approx(-0.7, abs=0.03)


def test_draws_stay_within_bounds_and_repeat_with_their_seed() -> None:
    found = found_with("gripper_slip=0.0001,threshold=0.5", poisson_ratio=0.498)
    draws = draw(found, 200, seed=9)
    assert draws == draw(found, 200, seed=9)
    assert draws != draw(found, 200, seed=10)
    assert max(one.poisson_ratio for one in draws) < 0.5


def test_fewer_draws_than_answers_are_refused() -> None:
    with pytest.raises(InputError, match="--draws 2: there are 3 answers"):
        draw(found_of(a_diagnosis()), 2, seed=1)


def test_both_tables_hold_the_same_draws(tmp_path: Path) -> None:
    draws = draw(found_of(a_diagnosis()), 20, seed=1)
    write_draws(draws, tmp_path)
    with (tmp_path / "draws.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    objects = json.loads((tmp_path / "draws.json").read_text())
    assert len(rows) == len(objects) == 20
    for row, one in zip(rows, objects, strict=True):
        assert float(row["youngs_modulus"]) == one["youngs_modulus"]
        given = {name: float(text) for name, text in row.items() if "." in name and text}
        assert given == one["parameters"]


def test_a_cause_with_a_size_for_each_experiment_is_read_for_as_many_as_there_were() -> None:
    sizes = {f"gain_in_experiment_{order}": quantity(0.1 * order, 0.01) for order in (1, 2, 3, 4, 5)}
    told = {"force_axis_gain": {"form": "fx_of_each_experiment", "parameters": sizes}}
    five = [replace(Experiment.of_block([(0, 0, 0), (0.002, 0, 0)]), order=order) for order in range(1, 6)]
    catalogue = default_catalogue().looked_for_in(five)
    (cause,) = found_of(a_diagnosis(effects=told), catalogue).verdict.causes
    assert cause.values == {
        f"gain_in_experiment_{order}": pytest.approx(0.1 * order) for order in (1, 2, 3, 4, 5)
    }
    assert not found_of(a_diagnosis(effects=told)).verdict.causes  # the usual three do not fit
