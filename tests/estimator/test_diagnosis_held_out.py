"""What left-out experiments say of a cause."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.case import Linearisation
from estimator.diagnosis.held_out import lost_on_held_out
from estimator.diagnosis.hypothesis import Hypothesis, coordinates
from estimator.effects.torque_centre import TorqueCentre

MATERIAL = Hypothesis(1e4, 0.45)


def fitted(*sizes: float) -> Linearisation:
    """A fit whose residual in each experiment has some length, and nothing along E or nu."""
    rng = np.random.default_rng(3)
    found = [np.linalg.qr(rng.normal(size=(30, 3)))[0] for _ in sizes]
    residual = tuple(size * block[:, 2] for size, block in zip(sizes, found, strict=True))
    columns = tuple(block[:, :2] for block in found)
    return Linearisation(MATERIAL, coordinates(MATERIAL), (), residual, columns, (), ())


def test_what_a_cause_makes_worse_there_is_lost_by_half_its_square() -> None:
    assert lost_on_held_out(fitted(3.0, 5.0), fitted(3.0, 4.0)) == pytest.approx((25.0 - 16.0) / 2.0)


def test_what_it_makes_better_costs_nothing() -> None:
    assert lost_on_held_out(fitted(3.0, 2.0), fitted(3.0, 4.0)) == 0.0


def test_one_experiment_alone_does_not_speak_against_a_cause() -> None:
    assert lost_on_held_out(fitted(5.0), fitted(4.0)) == 0.0


def test_a_parameter_that_only_one_experiment_sees_is_not_held_against_it() -> None:
    # The second experiment hardly sees the offset: by itself it would put it far from where the first has it.
    rng = np.random.default_rng(8)
    effect = TorqueCentre()
    hypothesis = MATERIAL.with_effect(effect, {a.name: 0.0 for a in effect.amplitudes})
    free = coordinates(hypothesis)
    sees = [np.linalg.qr(rng.normal(size=(60, len(free))))[0] for _ in range(2)]
    for block, strength in zip(sees, (1e5, 1e3), strict=True):
        block[:, 2:] *= strength
    noise = [rng.normal(size=60) for _ in range(2)]
    offset = 4e-3 * sees[0][:, 2:].sum(axis=1)
    baseline = Linearisation(
        MATERIAL, free[:2], (), (noise[0] + offset, noise[1]), tuple(b[:, :2] for b in sees), (), ()
    )
    found = Linearisation(hypothesis, free, (), tuple(noise), tuple(sees), (), ())
    assert lost_on_held_out(found, baseline) == 0.0
    elsewhere = Linearisation(
        hypothesis, free, (), (noise[0], noise[1] + 20 * sees[0][:, 0]), tuple(sees), (), ()
    )
    assert lost_on_held_out(elsewhere, replace(baseline, residual=(noise[0], noise[1]))) > 100.0
