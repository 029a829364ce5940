"""How far an effect stands out is told in units of all the noise of a case, as it is correlated."""

import numpy as np
import pytest
from scipy.signal import lfilter

from estimator.blind.making.scenes.retraction import Manner, rows_of
from estimator.blind.making.scenes.setup import SENSOR
from estimator.blind.making.scenes.whitening import pose_of_row, whitened, whitening_of

ROWS = rows_of("pull", 1, Manner())
BEADS = 16


def by_position(random: np.random.Generator) -> np.ndarray:
    """Springs of 700 N/m, and beads that follow the gripper by a third."""
    found = np.zeros((len(ROWS.time), 6 + 3 * BEADS, 3))
    found[:, :3] = 700.0 * np.eye(3)
    found[:, 6:] = np.tile(np.eye(3) / 3, (BEADS, 1)) * random.uniform(0.5, 1.5, (len(found), 1, 1))
    return found


def lasting(random: np.random.Generator, correlation: float, shape: tuple[int, ...]) -> np.ndarray:
    """Noise of unit variance along the first axis, correlated with the row before."""
    drawn = random.standard_normal(shape)
    drawn[1:] *= np.sqrt(1.0 - correlation**2)
    return np.asarray(lfilter([1.0], [1.0, -correlation], drawn, axis=0))


@pytest.mark.parametrize("correlation", [0.0, 0.5])
def test_noise_of_sensors_and_poses_whitens_to_unit_variance_in_every_direction(correlation: float) -> None:
    random = np.random.default_rng(3)
    change = by_position(random)
    whitening = whitening_of(ROWS, change, SENSOR, correlation)
    pose = pose_of_row(ROWS)
    rows = np.bincount(pose)
    samples = []
    for _ in range(600):
        off = SENSOR.position_std / np.sqrt(rows)[:, None] * random.standard_normal((len(rows), 3))
        white = lasting(random, correlation, change.shape[:2]) * whitening.deviation
        samples.append(whitened([whitening], [white + np.einsum("rci,ri->rc", change, off[pose])]))
    along = np.array(samples) @ whitening.vectors
    assert abs(np.var(along, axis=0).mean() - 1.0) < 0.03
    assert np.abs(np.var(along, axis=0) - 1.0).max() < 0.3
    assert abs(np.var(samples) - 1.0) < 0.01


def test_what_a_pose_error_imitates_stands_out_less() -> None:
    random = np.random.default_rng(4)
    change = by_position(random)
    whitening = whitening_of(ROWS, change, SENSOR)
    aside = np.zeros((len(ROWS.time), 3))
    aside[pose_of_row(ROWS) == 5, 2] = 1e-4
    imitated = np.einsum("rci,ri->rc", change, aside)
    other = random.permutation(imitated.ravel()).reshape(imitated.shape)
    white = float(np.linalg.norm(imitated / whitening.deviation))
    assert np.linalg.norm(whitening.apply(imitated)) < 0.7 * white
    assert np.linalg.norm(whitening.apply(other)) > 0.95 * np.linalg.norm(other / whitening.deviation)


def test_what_lasts_stands_out_less_of_noise_that_lasts() -> None:
    change = by_position(np.random.default_rng(5))
    white, lasts = (whitening_of(ROWS, change, SENSOR, correlation) for correlation in (0.0, 0.5))
    aside = np.zeros(change.shape[:2])
    aside[:, 20] = 3e-5
    # Of a mean of many rows the variance is (1 + 0.5) / (1 - 0.5) times that of white noise.
    told = np.linalg.norm(lasts.apply(aside)) / np.linalg.norm(white.apply(aside))
    assert told == pytest.approx(3.0**-0.5, rel=0.03)


def test_a_hold_and_its_way_back_are_stays_of_their_own() -> None:
    pose = pose_of_row(ROWS)
    assert pose[0] == 0
    assert (np.diff(pose) >= 0).all()
    turned_back = ROWS.position[pose == pose.max()][0]
    first = ROWS.position[pose == 0][0]
    np.testing.assert_allclose(turned_back, first)
    assert pose.max() == np.sum(np.abs(np.diff(ROWS.position[:, 0])) > 1e-9)
