"""Relaxation with a continuous spectrum of times: what it comes to, and what it stands for."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from retraction_cases import REFERENCE_BLOCK
from scipy.integrate import quad
from scipy.optimize import least_squares
from tissue_effects import PROBLEM, TISSUE

from estimator.effects.tissue.viscoelasticity import VISCOELASTICITY
from estimator.fem.terms.relaxation import Relaxation

FloatArray = NDArray[np.float64]

SPECTRUM = next(one for one in VISCOELASTICITY if one.form == "spectrum")
TIMES_S = np.geomspace(0.1, 150.0, 80)


def left(seconds: FloatArray, share: float, middle_s: float, half_width: float, lean: float) -> FloatArray:
    """The stress at times after a sudden strain, over that which stays."""
    values = {
        "relaxing_share_1": share,
        "relaxation_time_1": middle_s,
        "half_width_of_ln_time": half_width,
        "lean": lean,
    }
    (term,) = SPECTRUM.terms(PROBLEM, TISSUE, REFERENCE_BLOCK, values)
    assert isinstance(term, Relaxation)
    return 1.0 + term.shares @ np.exp(-seconds / term.times_s[:, None])


@pytest.mark.parametrize("half_width", [0.05, 1.0, 3.5])
@pytest.mark.parametrize("lean", [-1.0, 0.0, 0.7])
def test_a_band_is_the_integral_over_its_times(half_width: float, lean: float) -> None:
    seconds = np.array([0.5, 4.0, 30.0])

    def relaxed(time_s: float) -> float:
        def of(place: float) -> float:
            return 0.5 * (1.0 + lean * place) * np.exp(-time_s / (8.0 * np.exp(half_width * place)))

        return float(1.0 + 0.4 * quad(of, -1.0, 1.0)[0])

    expected = [relaxed(time_s) for time_s in seconds]
    np.testing.assert_allclose(left(seconds, 0.4, 8.0, half_width, lean), expected, atol=0.4 * 0.002)


@pytest.mark.parametrize(
    "law",
    [
        lambda t: 1.0 + (1.0 + t / 0.5) ** -0.15,
        lambda t: 1.0 + 0.8 * (1.0 + t) ** -0.3,
        lambda t: 1.0 + 0.4 * np.exp(-np.sqrt(t / 10.0)),
        lambda t: 1.0 + 0.4 * np.exp(-t[:, None] / np.geomspace(0.5, 100.0, 400)).mean(axis=1),
    ],
    ids=["power 0.15", "power 0.3", "stretched", "fung"],
)
def test_it_stands_for_the_usual_laws_where_single_times_do_not(
    law: Callable[[FloatArray], FloatArray],
) -> None:
    measured = law(TIMES_S)

    def misfit(p: FloatArray) -> FloatArray:
        return p[0] * left(TIMES_S, p[1], float(np.exp(p[2])), p[3], p[4]) - measured

    def of_one_time(p: FloatArray) -> FloatArray:
        return p[0] * (1.0 + p[1] * np.exp(-TIMES_S / np.exp(p[2]))) - measured

    bounds = ([0.0, 0.0, -2.3, 0.05, -1.0], [3.0, 5.0, 6.9, 3.5, 1.0])
    band = least_squares(misfit, [1.0, 0.4, 2.0, 1.5, 0.0], bounds=bounds, x_scale=0.1).fun
    single = least_squares(of_one_time, [1.0, 0.3, 2.0], x_scale=0.1).fun
    assert np.sqrt(np.mean(band**2)) < 1.35e-3
    assert np.sqrt(np.mean(single**2)) > 1.7e-2
