"""Two causes at once: pairs of signatures weighed together find what neither alone, nor one after the other, shows."""

from dataclasses import replace

import numpy as np
import pytest
from bare_contexts import bare_context, no_error_in
from numpy.typing import NDArray

from estimator.diagnosis.evidence.discrepancy import Discrepancy, ModelError
from estimator.diagnosis.evidence.signatures import Signature
from estimator.diagnosis.fitting.case import Linearisation
from estimator.diagnosis.model.free_parameters import free_parameters
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.search.pair_screening import likeliest_pairs
from estimator.diagnosis.search.screening import Trial, trials_of
from estimator.effects.catalogue import CATALOGUE

MATERIAL = Hypothesis(15e3, 0.45)
NOTHING = np.zeros((600, 1))
ERROR = no_error_in(Discrepancy((NOTHING, NOTHING), (np.zeros(1), np.zeros(1))))
DIRECTIONS = np.linalg.qr(np.random.default_rng(5).normal(size=(600, 6)))[0]
# Deviations of noise by which an effect of the usual size would move the measurements.
USUAL = 30.0


def signature(name: str, direction: NDArray[np.float64]) -> Signature:
    """One that points along a direction."""
    effect = next(one for one in CATALOGUE if one.name == name)
    null = MATERIAL.with_effect(effect, {amplitude.name: 0.0 for amplitude in effect.amplitudes})
    free = [c for c in free_parameters(null) if c.effect == 0]
    return Signature(effect, {}, tuple(free), (USUAL * direction[:, None] / free[0].prior_scale,))


def test_two_causes_are_found_whose_place_a_third_one_takes() -> None:
    one, other = DIRECTIONS[:, 2], DIRECTIONS[:, 3]
    signatures = [
        signature("camera_scale:uniform", one),
        signature("gripper_compliance:translation", other),
        signature("motion_scale:translation", (one + other) / np.sqrt(2.0)),
        signature("second_invariant:modified", DIRECTIONS[:, 4]),
    ]
    misfit = 20.0 * one + 12.0 * other
    base = Linearisation(MATERIAL, free_parameters(MATERIAL), (), (misfit,), (DIRECTIONS[:, :2],), (), ())
    alone = sorted(
        trials_of(bare_context(base, error=ERROR), signatures), key=lambda trial: -trial.log_evidence
    )
    assert alone[0].signature.effect.label == "motion_scale"
    pairs = likeliest_pairs(bare_context(base, error=ERROR), [Trial(s, 0.0, MATERIAL) for s in signatures])
    # Any two of the three span what both do.
    assert pairs[0].labels < {"camera_scale", "gripper_compliance", "motion_scale"}
    assert all("second_invariant" not in pair.labels for pair in pairs[:3])
    both = next(pair for pair in pairs if pair.labels == {"camera_scale", "gripper_compliance"})
    assert both.log_evidence > alone[0].log_evidence + 10.0
    scale, compliance = (s.free_parameters[0].prior_scale for s in signatures[:2])
    values = {name: value for each in both.hypothesis.values for name, value in each.items()}
    assert values["scale_error"] == pytest.approx(20.0 / USUAL * scale, rel=0.02)
    assert values["compliance"] == pytest.approx(12.0 / USUAL * compliance, rel=0.02)


def test_two_forms_of_one_cause_are_no_pair() -> None:
    signatures = [
        signature("force_axis_gain:fx", DIRECTIONS[:, 2]),
        signature("force_axis_gain:fy", DIRECTIONS[:, 3]),
    ]
    misfit = 20.0 * DIRECTIONS[:, 2] + 12.0 * DIRECTIONS[:, 3]
    base = Linearisation(MATERIAL, free_parameters(MATERIAL), (), (misfit,), (DIRECTIONS[:, :2],), (), ())
    assert not likeliest_pairs(bare_context(base, error=ERROR), [Trial(s, 0.0, MATERIAL) for s in signatures])


def test_what_falls_far_short_of_what_is_asked_is_weighed_with_one_floor_and_the_rest_with_all() -> None:
    smooth = DIRECTIONS[:, 5:]
    process = Discrepancy((smooth, NOTHING), (np.array([50.0]), np.zeros(1)))
    error = ModelError((process,), ((1.0, 0.0), (0.0, 0.0)), (1.0, 0.0))
    strong, weak = (signature("camera_scale:uniform", d) for d in (DIRECTIONS[:, 2], DIRECTIONS[:, 4]))
    misfit = 10.0 * DIRECTIONS[:, 2]
    base = Linearisation(MATERIAL, free_parameters(MATERIAL), (), (misfit,), (DIRECTIONS[:, :2],), (), ())

    def weighed(gain: float) -> list[float]:
        # Each by itself: beside a better one it would be far from the best.
        return [
            trials_of(bare_context(base, error=error), [one], gain)[0].log_evidence for one in (strong, weak)
        ]

    with_all, asked = weighed(-np.inf), weighed(20.0)
    assert asked[0] == with_all[0]
    one_floor = bare_context(base, error=replace(error, floors=(error.floor,)))
    assert asked[1] == pytest.approx(trials_of(one_floor, [weak])[0].log_evidence)
    assert asked[1] != pytest.approx(with_all[1], abs=0.5)
