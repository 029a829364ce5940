"""Wild single readings of a bead are left out, and nothing else."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from retraction_cases import SMALL_BLOCK

from estimator.diagnosis.noise.outliers import number_left_out, without_outliers
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.experiment import Experiment

SETTINGS = DiagnosisSettings()

FloatArray = NDArray[np.float64]
ROWS, BEADS = 60, 16


def measured(misfit: FloatArray) -> Experiment:
    return replace(
        SMALL_BLOCK,
        fiducials=np.zeros((ROWS, BEADS, 3)),
        fiducials_rest=np.zeros((BEADS, 3)),
        time=np.arange(float(ROWS)),
    )


def noise(seed: int) -> FloatArray:
    return np.random.default_rng(seed).normal(size=(ROWS, 6 + 3 * BEADS))


def left_out(misfit: FloatArray) -> list[tuple[int, int]]:
    """Rows and beads that are left out."""
    experiment = measured(misfit)
    (kept,) = without_outliers([experiment], [misfit], SETTINGS.noise)
    wild = np.isnan(kept.fiducials).all(axis=2)
    assert number_left_out([experiment], [kept]) == wild.sum()
    return [(int(row), int(bead)) for row, bead in np.argwhere(wild)]


def test_a_wild_reading_is_left_out_whole() -> None:
    misfit = noise(1)
    misfit[20, 6 + 3 * 5 + 1] += 9.0
    misfit[41, 6 + 3 * 2] -= 9.0
    assert left_out(misfit) == [(20, 5), (41, 2)]


def test_the_last_reading_is_left_out_where_it_is_wild() -> None:
    misfit = noise(1)
    misfit[-1, 6 + 3 * 5 + 1] += 9.0
    misfit[0, 6 + 3 * 2] -= 9.0
    assert left_out(misfit) == [(0, 2), (ROWS - 1, 5)]


def test_most_readings_six_deviations_aside_are_found_and_next_to_no_others() -> None:
    found, wrong = 0.0, 0
    for seed in range(20):
        misfit = noise(10 + seed)
        wild = np.random.default_rng(seed).random((ROWS, BEADS)) < 0.012
        misfit[:, 6::3] += 6.0 * wild
        lost = set(left_out(misfit))
        given = set(map(tuple, np.argwhere(wild).tolist()))
        found += len(lost & given) / len(given) / 20
        wrong += len(lost - given)
    assert found > 0.8
    # of 19 200 readings
    assert wrong < 20


def test_of_mere_noise_three_readings_in_ten_thousand_are_lost() -> None:
    lost = sum(len(left_out(noise(seed))) for seed in range(60))
    assert lost < 4e-4 * 60 * ROWS * BEADS


def test_a_bead_that_is_false_from_some_row_on_is_kept() -> None:
    misfit = noise(2)
    misfit[30:, 6 + 3 * 4 : 9 + 3 * 4] += 12.0
    assert all(bead != 4 for _, bead in left_out(misfit))


def test_a_turn_that_all_beads_share_is_kept() -> None:
    misfit = noise(3)
    misfit[:, 6:] += 10.0 * np.minimum(np.arange(ROWS), 30)[:, None]
    misfit[30:, 6:] -= 10.0 * np.arange(ROWS - 30)[:, None]
    assert left_out(misfit) == []


def test_beads_that_were_not_seen_do_no_harm() -> None:
    misfit = noise(4)
    misfit[10:14, 6:] = np.nan
    misfit[:, 6 + 3 * 7 : 9 + 3 * 7] = np.nan
    misfit[50, 6 + 3 * 1] += 9.0
    assert left_out(misfit) == [(50, 1)]
