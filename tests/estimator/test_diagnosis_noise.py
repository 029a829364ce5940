"""What files do not state of their noise is found from a misfit."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from retraction_cases import SMALL_BLOCK

from estimator.diagnosis.noise.estimation import noise_of, with_offsets_of
from estimator.diagnosis.settings import DiagnosisSettings

SETTINGS = DiagnosisSettings()

FloatArray = NDArray[np.float64]


def correlated_noise(rng: np.random.Generator, rows: int, channels: int, correlation: float) -> FloatArray:
    noise = rng.normal(size=(rows, channels))
    for row in range(1, rows):
        noise[row] = correlation * noise[row - 1] + np.sqrt(1.0 - correlation**2) * noise[row]
    return noise


@pytest.mark.parametrize("correlation", [0.0, 0.5])
def test_correlation_and_rest_positions_are_found_behind_a_smooth_misfit(correlation: float) -> None:
    rng = np.random.default_rng(4)
    grid = np.column_stack([np.indices((4, 4)).reshape(2, -1).T * 0.02, np.zeros(16)])
    experiment = replace(SMALL_BLOCK, fiducials_rest=grid)
    rows, misfits = 120, []
    rest = 0.4 * rng.normal(size=48)
    for _ in range(3):
        smooth = np.linspace(0.0, 5.0, rows)[:, None] * rng.normal(size=54)
        misfits.append(smooth + correlated_noise(rng, rows, 54, correlation) + np.append(np.zeros(6), rest))
    noise = noise_of([experiment] * 3, misfits, SETTINGS.noise)
    assert noise.wrench_correlation == pytest.approx(correlation, abs=0.1)
    assert noise.fiducial_correlation == pytest.approx(correlation, abs=0.05)
    # the smooth misfit's own roughness over the beads adds to it
    assert 0.3 < noise.rest_deviation <= 1.0


@pytest.mark.parametrize("zero", [0.0, 0.6])
def test_how_well_the_wrench_is_zeroed_shows_in_how_experiments_differ_not_in_what_they_share(zero) -> None:
    rng = np.random.default_rng(6)
    experiment = replace(SMALL_BLOCK, fiducials_rest=np.zeros((1, 3)))
    bias = np.array([2.0, -1.0, 0.5, 0.0, 3.0, 0.0])
    misfits = []
    for _ in range(8):
        wrench = rng.normal(size=(100, 6)) + bias + zero * rng.normal(size=6)
        misfits.append(np.column_stack([wrench, np.full((100, 3), np.nan)]))
    found = noise_of([experiment] * len(misfits), misfits, SETTINGS.noise).zero_deviation
    assert found == pytest.approx(max(zero, 0.05), rel=0.35)
    assert noise_of([experiment], misfits[:1], SETTINGS.noise).zero_deviation == 1.0


def test_a_better_fit_tells_the_zeros_anew_and_leaves_the_correlation() -> None:
    rng = np.random.default_rng(7)
    experiment = replace(SMALL_BLOCK, fiducials_rest=np.zeros((1, 3)))
    unseen = np.full((100, 3), np.nan)
    exact = [np.column_stack([correlated_noise(rng, 100, 6, 0.5), unseen]) for _ in range(8)]
    # A model that misses E has experiments of different loads differ.
    roughly = [misfit + 0.3 * rng.normal(size=9) for misfit in exact]
    before = noise_of([experiment] * 8, roughly, SETTINGS.noise)
    after = with_offsets_of(before, [experiment] * 8, exact, SETTINGS.noise)
    assert after.wrench_correlation == before.wrench_correlation > 0.3
    assert before.zero_deviation > 0.2
    assert after.zero_deviation < 0.1
