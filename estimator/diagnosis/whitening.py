"""The noise of one experiment, row by row, with everything that nobody calls an effect, and its whitening.

A row's channels carry the sensors' noise, white or correlated with that of the row before. On top of it lie errors
that many rows share: the zero of the wrench, the beads' stated rest positions, the reported pose of each visit, and
what is left of the discretisation error. With these as U η, η ~ N(0, 1), and the white part scaled to one, the
covariance is I + U Uᵀ, and its inverse root is I − Q (1 − (1 + λ)^−½) Qᵀ with the singular vectors Q and squared
singular values λ of U.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.hypothesis import Hypothesis, coordinates
from estimator.diagnosis.noise import Noise
from estimator.diagnosis.passage import Mechanics
from estimator.diagnosis.perturbation import Perturbation
from estimator.diagnosis.prediction import derivatives, derivatives_by_position
from estimator.effects.grasp_misplacement import GRASP_MISPLACEMENT
from estimator.experiment import Experiment
from estimator.fit.residuals import channel_variance, measured_rows
from estimator.forward.schedule import schedule_poses, travel

FloatArray = NDArray[np.float64]

# What is left of the discretisation error after its correction, as a share of the correction: for each channel apart,
# and of all channels of a kind together, for others' meshes err along with ours. The measurements of 13 clean cases of
# two other simulators are most probable with 0.05 apart and 0.1 together, those of a coarser mesh with 0.2 to 0.3
# together; of ten cases of one cause, at that cause, with 0.15 to 0.3 apart.
_LEFT_APART, _LEFT_TOGETHER = 0.2, 0.3
# Beside the rim of the grasp, where the solution is singular, the error falls with the root of the element size: even
# fine meshes differ in what a bead there does, and not along the correction's course alone, which may pass through zero
# where the difference is large. Most probable are 0.2 to 0.3 of the correction's largest length, 0.5 where tissue rubs.
_LEFT_BESIDE_RIM = 0.5
_BESIDE_RIM_M = 6e-3
_WAVES_BESIDE_RIM = 4
# Strains are singular along the edges of the grasp, the more so the less the tissue can be compressed, and a mesh acts
# as if these lay aside by this over 1 - 2 nu. The measurements of 21 clean cases of two other simulators are most
# probable with it, by 28 nats more than without: the shifts that they show grow like that, to 50 and 96 um at nu 0.475.
# None of them is nearer to incompressible than this, and where something is amiss the baseline's nu may be far off.
_EDGE_LEFT_M, _LARGEST_RATIO_SEEN = 2e-6, 0.48
# Tissue at rest is at rest on every mesh; from this share of the way on a bead may stand aside in full.
_FROM_REST = 0.1


@dataclass(frozen=True)
class Whitening:
    """The inverse root of one experiment's covariance.

    Attributes
    ----------
    seen : (n, c) bool, what was measured
    deviation : (c,) standard deviation of one value
    correlation : (c,) of one value's noise with that of the row before
    vectors : (r, k) orthonormal, over the measured values
    shrink : (k,) 1 − (1 + λ)^−½
    """

    seen: NDArray[np.bool_]
    deviation: FloatArray
    correlation: FloatArray
    vectors: FloatArray
    shrink: FloatArray

    def apply(self, columns: FloatArray) -> FloatArray:
        """Whiten columns (n, c, k) to (r, k)."""
        scaled = uncorrelated(columns / self.deviation[:, None], self.seen, self.correlation)
        return shrunk(scaled, self.vectors, self.shrink)

    def anew(self, columns: FloatArray, before: "Whitening") -> FloatArray:
        """Whiten columns (r, k) that were whitened before, by a whitening of other shared errors alone."""
        return shrunk(before._with_shared(columns), self.vectors, self.shrink)

    def undo(self, whitened: FloatArray) -> FloatArray:
        """Return the channels (n, c) whose whitened values these (r,) are; NaN where nothing was measured."""
        channels = np.full(self.seen.shape, np.nan)
        channels[self.seen] = self._with_shared(whitened[:, None])[:, 0]
        before, weight = _before(self.seen, self.correlation)
        for row in range(len(channels)):
            last = np.where(weight[row] > 0, channels[before[row], np.arange(len(self.deviation))], 0.0)
            channels[row] = np.sqrt(1.0 - weight[row] ** 2) * channels[row] + weight[row] * last
        return channels * self.deviation

    def _with_shared(self, whitened: FloatArray) -> FloatArray:
        """Return whitened columns (r, k) with the shared errors in them again: what was shrunk grows back."""
        return shrunk(whitened, self.vectors, -self.shrink / (1.0 - self.shrink))

    @property
    def floor(self) -> float:
        """Root mean square of a whitened residual that holds white noise alone, none of the shared errors."""
        return float(np.sqrt(1.0 - np.sum(1.0 - (1.0 - self.shrink) ** 2) / len(self.vectors)))

    @property
    def log_determinant(self) -> float:
        """Logarithm of the determinant of I + U Uᵀ."""
        return float(-2.0 * np.log1p(-self.shrink).sum())

    def residual(self, experiment: Experiment, predicted: FloatArray) -> FloatArray:
        """Return the whitened misfit (r,) of predicted channels (n, c)."""
        error = np.where(self.seen, measured_rows(experiment) - predicted, 0.0)
        return self.apply(error[:, :, None])[:, 0]


def uncorrelated(columns: FloatArray, seen: NDArray[np.bool_], correlation: FloatArray) -> FloatArray:
    """Return columns (n, c, k) at what was seen, (r, k), free of the correlation (c,) of each row with the one before.

    The first-order autoregression's innovations, (x_t - w x_s) / (1 - w²)^½, s being the last row seen before t and
    w the correlation to the power of their distance.
    """
    if not correlation.any():
        return np.asarray(columns[seen])
    before, weight = _before(seen, correlation)
    w = weight[:, :, None]
    last = np.take_along_axis(columns, np.broadcast_to(before[:, :, None], columns.shape), axis=0)
    last = np.where(w > 0, last, 0.0)
    return np.asarray(((columns - w * last) / np.sqrt(1.0 - w**2))[seen])


def _before(seen: NDArray[np.bool_], correlation: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
    """Return for each value the last row (n, c) before it that was seen, and the correlation with it, 0 for none."""
    rows = np.arange(len(seen))[:, None]
    latest = np.maximum.accumulate(np.where(seen, rows, -1), axis=0)
    before = np.vstack([np.full((1, seen.shape[1]), -1), latest[:-1]])
    weight = np.where(before >= 0, correlation ** (rows - before), 0.0)
    return np.maximum(before, 0), weight


def shrunk(columns: FloatArray, vectors: FloatArray, shrink: FloatArray) -> FloatArray:
    """Return columns (r, k) with their part along orthonormal vectors (r, q) reduced by the shares ``shrink`` (q,)."""
    return columns - vectors @ (shrink[:, None] * (vectors.T @ columns))


def inverse_root(directions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (vectors, shrink) of (I + U Uᵀ)^−½ for U (r, k)."""
    eigenvalues, eigenvectors = np.linalg.eigh(directions.T @ directions)
    kept = eigenvalues > 1e-9 * max(float(eigenvalues.max(initial=0.0)), 1e-300)
    root = np.sqrt(eigenvalues[kept])
    vectors = directions @ (eigenvectors[:, kept] / root)
    return vectors, 1.0 - 1.0 / np.sqrt(1.0 + eigenvalues[kept])


def whitening_of(
    mechanics: Mechanics, correction: FloatArray, noise: Noise, at_grasp: FloatArray | None = None
) -> Whitening:
    """Build the whitening of an experiment.

    Parameters
    ----------
    mechanics : of the fitted baseline, for its derivative by the gripper's position
    correction : (n, c) of the discretisation
    noise : what the file does not state of it
    at_grasp : (n, c, k) what meshes make of the edges of the grasp, by one deviation; none where left out
    """
    visits = mechanics.passage.visits
    experiment = visits.experiment
    seen = np.isfinite(measured_rows(experiment))
    deviation = np.sqrt(channel_variance(experiment))
    rows, count = seen.shape
    of_wrench = np.arange(count) < 6
    # The correction's course is not that of what is left of it: a bead may stand aside throughout. At rest it stands
    # where it is on every mesh, but its stated place may be off by what is usual for the beads.
    aside = np.where(of_wrench, 0.0, _LEFT_APART * np.sqrt(np.mean(correction**2, axis=0)))
    usual = float(np.median(aside[6:])) if count > 6 else 0.0
    at_rest = np.where(of_wrench, 0.0, np.minimum(aside, usual))
    offsets = np.hypot(np.where(of_wrench, noise.zero_deviation, noise.rest_deviation) * deviation, at_rest)
    shared = [np.broadcast_to(np.diag(offsets), (rows, count, count))]
    under_way = np.minimum(share_of_way(experiment) / _FROM_REST, 1.0)
    shared.append(under_way[:, None, None] * np.diag(np.sqrt(aside**2 - at_rest**2)))
    by_position = derivatives_by_position(mechanics) * np.sqrt(visits.position_variance)[:, None, None]
    of_visits = np.zeros((rows, count, len(visits), 3))
    of_visits[np.arange(rows), :, visits.of_row] = by_position[visits.of_row]
    shared.append(of_visits.reshape(rows, count, -1))
    shared.append(_LEFT_APART * correction[:, :, None] * np.eye(count))
    together = np.stack([np.where(of_wrench, correction, 0.0), np.where(of_wrench, 0.0, correction)], axis=-1)
    shared.append(_LEFT_TOGETHER * together)
    shared.append(left_beside_rim(experiment, correction))
    if at_grasp is not None:
        shared.append(at_grasp)
    correlation = np.where(of_wrench, noise.wrench_correlation, noise.fiducial_correlation)
    directions = uncorrelated(np.concatenate(shared, axis=2) / deviation[:, None], seen, correlation)
    return Whitening(seen, deviation, correlation, *inverse_root(directions))


def share_of_way(experiment: Experiment) -> FloatArray:
    """Return how far the gripper is from rest in each row (n,), as a share of the farthest it goes."""
    schedule = schedule_poses(experiment)
    way = travel(schedule)[schedule.state_of_row]
    return np.asarray(way / max(float(way.max()), np.finfo(float).tiny))


def left_beside_rim(experiment: Experiment, correction: FloatArray) -> FloatArray:
    """Return directions (n, c, k), m, of what meshes make of the beads beside the grasp's rim, along the gripper's way.

    It depends on where the gripper is, not on how it came there. ``correction`` (n, c) is that of the discretisation.
    """
    beside = np.flatnonzero(experiment.grasp.box.distance(experiment.fiducials_rest) < _BESIDE_RIM_M)
    share = share_of_way(experiment)
    waves = share[:, None] * np.cos(np.pi * np.outer(share, np.arange(_WAVES_BESIDE_RIM)))
    waves /= np.sqrt(_WAVES_BESIDE_RIM)
    rows, count = correction.shape
    found = np.zeros((rows, count, len(beside), 3, _WAVES_BESIDE_RIM))
    of_beads = correction[:, 6:].reshape(rows, -1, 3)
    for number, bead in enumerate(beside):
        size = _LEFT_BESIDE_RIM * np.linalg.norm(of_beads[:, bead], axis=1).max()
        for axis in range(3):
            found[:, 6 + 3 * bead + axis, number, axis] = size * waves
    return found.reshape(rows, count, -1)


def left_at_grasp(
    mechanics: Sequence[Mechanics], hypothesis: Hypothesis, corrections: Sequence[FloatArray]
) -> list[FloatArray]:
    """Return for each experiment what a mesh makes of the singular edges of the grasp (n, c, k), by one deviation.

    Parameters
    ----------
    mechanics : of each experiment, solved under the hypothesis
    corrections : of the discretisation, (n, c) each
    """
    jaws = next(effect for effect in GRASP_MISPLACEMENT if effect.form == "jaws")
    null = hypothesis.with_effect(jaws, {amplitude.name: 0.0 for amplitude in jaws.amplitudes})
    free = [c for c in coordinates(null) if c.effect is not None]
    shifts = [Perturbation(c.name, c.put(null, c.step), jaws, c.step) for c in free]
    deviation_m = _EDGE_LEFT_M / (1.0 - 2.0 * min(hypothesis.poisson_ratio, _LARGEST_RATIO_SEEN))
    return [deviation_m * slope for slope in derivatives(mechanics, hypothesis, shifts, corrections)]
