"""Rows that are off by themselves: beads that shake together, images out of step."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.fft import idct
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from estimator.diagnosis.evidence.row_errors import evidence_of_unsteadiness
from estimator.diagnosis.noise.estimation import robust_deviation
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.inference.whitening import Whitening, inverse_root

SETTINGS = DiagnosisSettings()

FloatArray = NDArray[np.float64]


def white(seen: NDArray[np.bool_]) -> Whitening:
    count = seen.shape[1]
    return Whitening(seen, np.ones(count), np.zeros(count), np.zeros((seen.sum(), 0)), np.zeros(0))


def evidence_of_rows_off(channels: FloatArray, predicted: FloatArray) -> float:
    """What single rows that are off add, in a misfit of white noise; one bead is hidden for a while."""
    seen = np.ones(channels.shape, dtype=bool)
    seen[40:60, 6:9] = False
    return evidence_of_unsteadiness([channels[seen]], [white(seen)], [predicted], SETTINGS.evidence)


def test_the_evidence_is_that_of_the_joint_normal() -> None:
    rng, rows, beads = np.random.default_rng(3), 24, 3
    misfit, course = (
        rng.normal(size=(rows, 6 + 3 * beads)),
        rng.normal(size=(rows, 6 + 3 * beads)).cumsum(axis=0),
    )
    of_beads = misfit[:, 6:] / robust_deviation(misfit[:, 6:])
    # Of 24 cosines those from the third on have periods of less than sixteen rows.
    quick = idct(np.eye(rows), norm="ortho", axis=0)[:, 3:]
    along = np.gradient(course[:, 6:], axis=0)
    along /= np.abs(along).max()
    shaking = np.einsum("nk,cx->ncxk", quick, np.tile(np.eye(3), (beads, 1)))
    ahead = np.einsum("nc,nk->nck", along, quick)
    gained = []
    for directions in (shaking, ahead):
        D = directions.reshape(of_beads.size, -1)
        for amplitude in (0.1, 0.16, 0.25, 0.4):
            known = multivariate_normal(cov=np.eye(len(D)) + amplitude**2 * D @ D.T).logpdf(of_beads.ravel())
            gained.append(known - multivariate_normal(cov=np.eye(len(D))).logpdf(of_beads.ravel()))
    misfit[:, 6:] = of_beads
    found = evidence_of_unsteadiness(
        [misfit.ravel()], [white(np.ones(misfit.shape, dtype=bool))], [course], SETTINGS.evidence
    )
    assert found == pytest.approx(logsumexp(gained) - np.log(8.0), abs=1e-9)


@pytest.mark.parametrize("noise", [1.0, 1.3])
def test_beads_that_shake_together_are_told_from_noise_of_whatever_size(noise: float) -> None:
    rng = np.random.default_rng(7)
    still = noise * rng.normal(size=(180, 6 + 48))
    drifting = still + 5.0 * np.linspace(-1.0, 1.0, 180)[:, None]
    shaken = still.copy()
    shaken[:, 6:] += np.tile(0.2 * noise * rng.normal(size=(180, 3)), 16)
    nowhere = np.zeros(still.shape)
    assert evidence_of_rows_off(still, nowhere) < 0.0
    assert evidence_of_rows_off(drifting, nowhere) < 0.0
    assert evidence_of_rows_off(shaken, nowhere) > 20.0


def test_beside_what_values_share_only_the_noise_of_the_beads_is_more() -> None:
    rng, rows, beads, noise = np.random.default_rng(17), 24, 3, 1.5
    channels = 6 + 3 * beads
    vectors, shrink = inverse_root(rng.normal(size=(rows * channels, 20)))
    seen = np.ones((rows, channels), dtype=bool)
    whitening = replace(white(seen), vectors=vectors, shrink=shrink)
    residual = rng.normal(size=rows * channels)
    shared, of_bead = vectors @ (vectors.T @ residual), np.tile(np.arange(channels) >= 6, rows)
    own = (residual - shared) / np.sqrt(1.0 - np.sum(vectors**2, axis=1))
    residual = shared + (residual - shared) * noise / robust_deviation(own[of_bead])
    S = np.eye(len(residual)) - vectors @ np.diag(shrink) @ vectors.T
    K = np.eye(len(residual)) + (noise**2 - 1.0) * S @ np.diag(of_bead.astype(float)) @ S
    quick = idct(np.eye(rows), norm="ortho", axis=0)[:, 3:]
    shaking = np.zeros((rows, channels, 3, quick.shape[1]))
    shaking[:, 6:] = np.einsum("nk,cx->ncxk", quick, np.tile(np.eye(3), (beads, 1)))
    D = S @ shaking.reshape(len(residual), -1)
    Q, _ = np.linalg.qr(D)
    gained = []
    for amplitude in (0.1, 0.16, 0.25, 0.4):
        alone, with_rows_off = Q.T @ K @ Q, Q.T @ (K + amplitude**2 * D @ D.T) @ Q
        both = [multivariate_normal(cov=cov).logpdf(Q.T @ residual) for cov in (with_rows_off, alone)]
        gained.append(both[0] - both[1])
    # Beads that stand still have no paths on which to be ahead: that adds nothing, whatever the amplitude.
    found = evidence_of_unsteadiness([residual], [whitening], [np.zeros(seen.shape)], SETTINGS.evidence)
    assert found == pytest.approx(logsumexp([*gained, 0.0, 0.0, 0.0, 0.0]) - np.log(8.0), abs=1e-6)


@pytest.mark.parametrize("noise", [0.5, 1.0, 1.5])
def test_poses_that_err_from_row_to_row_are_not_taken_for_beads_that_shake(noise: float) -> None:
    rng, rows, beads = np.random.default_rng(11), 60, 16
    of_a_row = np.vstack([10.0 * np.eye(6)[:, :3], np.tile(np.eye(3), (beads, 1))])
    by_pose = np.einsum("nm,ci->ncmi", np.eye(rows), of_a_row)
    vectors, shrink = inverse_root(by_pose.reshape(-1, 3 * rows))
    seen = np.ones((rows, 6 + 3 * beads), dtype=bool)
    whitening = replace(white(seen), vectors=vectors, shrink=shrink)
    found = []
    for _ in range(5):
        of_values = rng.normal(size=seen.shape) * np.where(np.arange(seen.shape[1]) < 6, 1.0, noise)
        channels = of_values + np.einsum("ncmi,mi->nc", by_pose, rng.normal(size=(rows, 3)))
        residual, nowhere = whitening.residual(channels, np.zeros(seen.shape)), np.zeros(seen.shape)
        found.append(evidence_of_unsteadiness([residual], [whitening], [nowhere], SETTINGS.evidence))
    assert max(found) < 0.5


def test_rows_that_show_beads_where_they_were_before_are_out_of_step_and_late_cameras_are_not() -> None:
    rng = np.random.default_rng(5)
    still, moving = np.zeros((20, 3, 3)), np.linspace(0.0, 400.0, 60)[:, None, None] * rng.normal(size=(3, 3))
    course = np.concatenate([still, moving, moving[-1] + still]).reshape(100, 9)
    predicted, velocity = np.hstack([np.zeros((100, 6)), course]), np.gradient(course, axis=0)
    noise = rng.standard_normal((100, 15))

    def judged(rows_late: FloatArray) -> float:
        channels = noise.copy()
        channels[:, 6:] -= rows_late[:, None] * velocity
        return evidence_of_rows_off(channels, predicted)

    assert judged(np.zeros(100)) < 0.0
    assert judged(np.full(100, 0.5)) < 0.0
    assert judged(0.5 * (rng.random(100) < 0.2)) > 20.0


def test_where_no_bead_was_seen_no_row_is_off() -> None:
    seen = np.repeat([[True] * 6 + [False] * 3], 20, axis=0)
    assert (
        evidence_of_unsteadiness(
            [np.ones(seen.sum())], [white(seen)], [np.zeros(seen.shape)], SETTINGS.evidence
        )
        == 0.0
    )
