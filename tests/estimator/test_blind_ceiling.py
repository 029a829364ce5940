"""How often the best possible test names a cause, against cases whose answer is known."""

import numpy as np
import pytest
from scipy.stats import norm

from estimator.blind.scoring.ceiling import Ceiling, ceiling_of, ceilings
from estimator.diagnosis.evidence.rivals import Rivals, projected


def test_alike_causes_are_named_by_chance_and_unlike_ones_always_once_they_stand_out() -> None:
    alike = np.array([[1.0, 1.0 - 1e-6, 0.0], [1.0 - 1e-6, 1.0, 0.0], [0.0, 0.0, 1.0]])
    found = ceilings(Rivals(("slip", "yield", "bias"), (1, 1, 1), alike))
    assert found["bias"].at(30.0) == 1.0
    assert found["slip"].at(30.0) == pytest.approx(0.5, abs=0.1)
    assert found["yield"].at(30.0) == pytest.approx(0.5, abs=0.1)


def test_an_only_cause_is_seen_as_often_as_a_test_of_its_length_sees_it() -> None:
    found = ceilings(Rivals(("bias",), (1,), np.eye(1)))
    for sigma in (2.0, 3.0, 4.5):
        power = norm.sf(norm.isf(0.025) - sigma) + norm.cdf(-norm.isf(0.025) - sigma)
        assert found["bias"].at(sigma) == pytest.approx(power, abs=0.09)


def test_two_causes_at_an_angle_are_confused_as_often_as_noise_crosses_between_them() -> None:
    cosine = 0.95
    found = ceilings(Rivals(("slip", "yield"), (1, 1), np.array([[1.0, cosine], [cosine, 1.0]])))
    # Noise must carry the misfit beyond the bisector: half the angle between them away, at a length of sigma.
    expected = norm.cdf(9.0 * np.sqrt((1.0 - cosine) / 2.0))
    assert found["slip"].at(9.0) == pytest.approx(expected, abs=0.05)


def test_what_nuisances_imitate_has_no_ceiling() -> None:
    rng = np.random.default_rng(2)
    columns = rng.normal(size=(50, 3))
    columns = np.column_stack([columns, columns[:, 1], rng.normal(size=50)])
    rivals, _ = projected(columns.T @ columns, 2, ["swallowed", "seen"], [1, 1])
    assert set(ceilings(rivals)) == {"seen"}


def test_a_ceiling_lies_between_those_of_its_neighbours_and_takes_the_best_of_equal_answers() -> None:
    one = Ceiling((1.0, 100.0), (0.2, 0.8))
    assert one.at(10.0) == pytest.approx(0.5)
    assert (one.at(0.1), one.at(1e4)) == (0.2, 0.8)
    assert ceiling_of({"a": one}, ("b",), 3.0) is None
    assert ceiling_of({"a": one, "b": Ceiling((1.0,), (0.9,))}, ("a", "b"), 10.0) == 0.9
