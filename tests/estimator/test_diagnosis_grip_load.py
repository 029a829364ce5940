"""The load that a gripper yields to: what was measured, without its noise."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numpy.typing import NDArray
from retraction_cases import SMALL_BLOCK, follow, from_rest, recorded, straight_pull

from estimator.diagnosis.model.grip_load import without_noise
from estimator.diagnosis.noise.errors_left import AT_MOST
from estimator.diagnosis.search.baseline import prepare
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.fem.equilibrium.observation import observe
from estimator.fit.settings import FitSettings
from estimator.forward.meshing import mesh_experiment
from estimator.materials import NeoHookean
from estimator.materials.material import Material

SETTINGS = DiagnosisSettings()

ROWS = 79
NOISE = 0.01
TRAVEL = np.concatenate([np.linspace(0.0, 1.0, 40), np.ones(9), np.linspace(1.0, 0.0, 30)])
PREDICTED = np.outer(TRAVEL * (1.0 + 0.2 * TRAVEL), [1.5, 0.3, 0.1, 0.01, 0.02, 0.01])


def noise(seed: int) -> NDArray[np.float64]:
    return NOISE * np.random.default_rng(seed).normal(size=(ROWS, 6))


def rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.parametrize("seed", range(5))
def test_of_a_load_that_is_predicted_a_tenth_too_large_hardly_any_noise_is_left(seed: int) -> None:
    found = without_noise(0.9 * PREDICTED + noise(seed), PREDICTED, SETTINGS.solver.load_waves)
    off = found - 0.9 * PREDICTED
    assert rms(off - off.mean(axis=0)) < 0.35 * NOISE


def test_a_relaxation_that_was_not_predicted_is_kept() -> None:
    relaxed = PREDICTED * (1.0 - 0.1 * np.linspace(0.0, 1.0, ROWS))[:, None]
    off = without_noise(relaxed + noise(7), PREDICTED, SETTINGS.solver.load_waves) - relaxed
    assert rms((off - off.mean(axis=0))[:, 0]) < 0.5 * NOISE
    assert rms((relaxed - PREDICTED)[:, 0]) > 5 * NOISE


def test_rows_without_a_measurement_are_filled_and_a_channel_without_any_is_taken_as_predicted() -> None:
    measured = PREDICTED + noise(3)
    measured[10:14] = np.nan
    measured[:, 5] = np.nan
    found = without_noise(measured, PREDICTED, SETTINGS.solver.load_waves)
    assert found[10:14] == pytest.approx(PREDICTED[10:14], abs=NOISE)
    assert found[:, 5] == pytest.approx(PREDICTED[:, 5])


def test_the_gripper_of_a_prepared_case_yields_to_less_than_half_of_the_noise() -> None:
    problem, truth = mesh_experiment(SMALL_BLOCK), Material(NeoHookean(), 20e3, 0.44)
    poses = from_rest(SMALL_BLOCK, straight_pull(SMALL_BLOCK, 0.012, 8))
    seen = [observe(problem, state) for state in follow(problem, truth, poses)]
    exact = np.repeat([one.wrench for one in seen], 4, axis=0)
    measured = recorded(SMALL_BLOCK, poses, seen, np.random.default_rng(11))
    with ThreadPoolExecutor(1) as executor:
        preparation, _ = prepare([measured], SETTINGS, FitSettings(), executor)
    felt = preparation.cases(AT_MOST).loads[0].felt
    off = [wrench - exact for wrench in (felt, measured.wrench)]
    left, noisy = (rms((one - one.mean(axis=0))[:, :3]) for one in off)
    assert left < 0.5 * noisy
