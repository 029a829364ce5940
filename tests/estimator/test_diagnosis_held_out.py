"""What left-out experiments say of a cause."""

import numpy as np
import pytest

from estimator.diagnosis.case import Linearisation
from estimator.diagnosis.held_out import lost_on_held_out
from estimator.diagnosis.hypothesis import Hypothesis, coordinates

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
