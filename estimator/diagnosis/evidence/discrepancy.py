"""What nothing in the catalogue explains: a smooth misfit, as a Gaussian process over rows and places.

A wrench channel's misfit is smooth along the experiment, and one of the fiducials smooth over the plane as well. In
units of the sensors' noise it is B g with g ~ N(0, s²): cosines along the rows (length scale a third of the
experiment) times, for fiducials, polynomials over the plane. An amplitude s large enough explains any smooth gap; a
small one forgives a named effect the inexactness of its own signature (Kennedy & O'Hagan 2001; gap of a model that
is nearly right).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.noise.estimation import plane_polynomials
from estimator.diagnosis.settings import EvidenceSettings
from estimator.experiment import Experiment
from estimator.inference.whitening import Whitening

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Discrepancy:
    """The Gaussian process of one experiment, for wrench and fiducials apart.

    Attributes
    ----------
    vectors : two of (r, k), orthonormal, over the whitened measurements
    eigenvalues : two of (k,), variance along them per unit of s²
    """

    vectors: tuple[FloatArray, FloatArray]
    eigenvalues: tuple[FloatArray, FloatArray]

    @cached_property
    def overlap(self) -> FloatArray:
        """Inner products (q, p) of the fiducials' vectors with the wrench's: whitening may share what both show."""
        return np.asarray(self.vectors[1].T @ self.vectors[0])


@dataclass(frozen=True)
class ModelError:
    """What any model misses, of a case.

    Attributes
    ----------
    processes : of each experiment
    floors : amplitudes (wrench, fiducials) in units of the noise that even the right model may miss, each as likely
        beforehand
    floor : the one of them that is reckoned with where one is enough
    settings : how a hypothesis is weighed beside it
    """

    processes: tuple[Discrepancy, ...]
    floors: tuple[tuple[float, float], ...]
    floor: tuple[float, float]
    settings: EvidenceSettings = field(default_factory=EvidenceSettings)


@dataclass(frozen=True)
class Moments:
    """Inner products of k columns over the whitened measurements: all that weighing them takes.

    Attributes
    ----------
    gram : (k, k) of the columns with each other, over all experiments
    along : for each experiment (p, k) and (q, k), with the discrepancy's vectors of wrench and of fiducials
    """

    gram: FloatArray
    along: tuple[tuple[FloatArray, FloatArray], ...]

    def among(self, chosen: Sequence[int]) -> Moments:
        """Return the inner products of some of the columns."""
        picked = tuple((wrench[:, chosen], fiducials[:, chosen]) for wrench, fiducials in self.along)
        return Moments(self.gram[np.ix_(chosen, chosen)], picked)


def model_error_of(
    experiments: Sequence[Experiment],
    whitenings: Sequence[Whitening],
    predicted: Sequence[FloatArray],
    settings: EvidenceSettings,
) -> ModelError:
    """Build the model error of a case.

    Parameters
    ----------
    predicted : for each experiment (n, 6 + 3m), channels of the baseline, whose size the floor goes by
    settings : EvidenceSettings
    """
    floors = floors_of(experiments, whitenings, predicted, settings)
    processes = [discrepancy_of(e, w, settings) for e, w in zip(experiments, whitenings, strict=True)]
    return ModelError(tuple(processes), floors, floors[0], settings)


def floors_of(
    experiments: Sequence[Experiment],
    whitenings: Sequence[Whitening],
    predicted: Sequence[FloatArray],
    settings: EvidenceSettings,
) -> tuple[tuple[float, float], ...]:
    """Return the amplitudes (wrench, fiducials) in units of the noise that even the right model may miss.

    That is up to a share of the signal, or of the noise where that is more. It is as likely to be any share of that on
    a grid: next to nothing, where the model's errors have been corrected well.
    """
    squares, counts = np.zeros(2), np.zeros(2)
    for experiment, whitening, channels in zip(experiments, whitenings, predicted, strict=True):
        rest = np.concatenate([np.zeros(6), experiment.fiducials_rest.ravel()])
        size = ((channels - rest) / whitening.deviation) ** 2
        squares += [size[:, :3].sum(), size[:, 6:].sum()]
        counts += [size[:, :3].size, size[:, 6:].size]
    sizes = np.sqrt(squares / np.maximum(counts, 1))
    wrench, fiducials = np.maximum(settings.smallest_floor, settings.floor_share * sizes)
    return tuple(
        (float(w * wrench), float(f * fiducials)) for w, f in itertools.product(settings.floors, repeat=2)
    )


def discrepancy_of(experiment: Experiment, whitening: Whitening, settings: EvidenceSettings) -> Discrepancy:
    """Build the process of an experiment."""
    unit = whitening.deviation[:, None]
    return discrepancy_along(*(whitening.apply(unit * part) for part in smooth_misfits(experiment, settings)))


def smooth_misfits(experiment: Experiment, settings: EvidenceSettings) -> tuple[FloatArray, FloatArray]:
    """Return the columns (n, 6 + 3m, k) of B for the wrench and for the fiducials, in units of a value's noise."""
    rows, beads = len(experiment.time), len(experiment.fiducials_rest)
    waves = _waves(rows, settings)
    count = 6 + 3 * beads
    wrench = np.zeros((rows, count, 6, waves.shape[1]))
    for channel in range(6):
        wrench[:, channel, channel] = waves
    plane = _plane(experiment.fiducials_rest, settings.plane_m)
    vision = np.zeros((rows, count, 3, plane.shape[1], waves.shape[1]))
    for axis in range(3):
        vision[:, 6 + axis :: 3, axis] = np.einsum("mp,nw->nmpw", plane, waves)
    return wrench.reshape(rows, count, -1), vision.reshape(rows, count, -1)


def discrepancy_along(wrench: FloatArray, fiducials: FloatArray) -> Discrepancy:
    """Build the process of whitened columns, (r, k) each."""
    found = [_principal(part) for part in (wrench, fiducials)]
    return Discrepancy((found[0][0], found[1][0]), (found[0][1], found[1][1]))


def moments_of(error: ModelError, columns: Sequence[FloatArray]) -> Moments:
    """Return the inner products of whitened columns, for each experiment (r, k)."""
    gram = np.sum([block.T @ block for block in columns], axis=0)
    along = [
        (process.vectors[0].T @ block, process.vectors[1].T @ block)
        for process, block in zip(error.processes, columns, strict=True)
    ]
    return Moments(gram, tuple(along))


def forgiven(error: ModelError, moments: Moments, amplitude: tuple[float, float]) -> tuple[FloatArray, float]:
    """Whiten columns further by a discrepancy of amplitude (wrench, fiducials) in units of the noise.

    With S = I - V W Vᵀ for the wrench and then for the fiducials, V the discrepancy's vectors, (S X)ᵀ(S X) =
    XᵀX - (VᵀX)ᵀ(2 W - W²)(VᵀX), so that no measurement is looked at again.

    Returns
    -------
    gram : (k, k) inner products of the whitened columns
    log_determinant : of the covariance, over all experiments
    """
    gram, log_determinant = moments.gram.copy(), 0.0
    for process, (by_wrench, by_fiducials) in zip(error.processes, moments.along, strict=True):
        wrench, fiducials = (1.0 + s**2 * e for s, e in zip(amplitude, process.eigenvalues, strict=True))
        shrunk_wrench = (1.0 - 1.0 / np.sqrt(wrench))[:, None] * by_wrench
        left = by_fiducials - process.overlap @ shrunk_wrench
        gram -= by_wrench.T @ ((1.0 - 1.0 / wrench)[:, None] * by_wrench)
        gram -= left.T @ ((1.0 - 1.0 / fiducials)[:, None] * left)
        log_determinant += float(np.log(wrench).sum() + np.log(fiducials).sum())
    return gram, log_determinant


def _waves(rows: int, settings: EvidenceSettings) -> FloatArray:
    """Cosines (n, w) along the rows with the spectrum of a squared exponential; unit variance in all."""
    x = (np.arange(rows) + 0.5) / rows
    order = np.arange(settings.waves)
    weight = np.exp(-0.5 * (np.pi * order * settings.length / 2) ** 2)
    weight /= np.sqrt(np.sum(weight**2))
    return np.cos(np.pi * np.outer(x, order)) * weight


def _plane(rest: FloatArray, unit_m: float) -> FloatArray:
    """Polynomials (m, 6) up to the second degree over the beads' places; unit variance in all, roughly."""
    found = plane_polynomials(rest, unit_m)
    return np.asarray(found / np.sqrt(found.shape[1]))


def _principal(part: FloatArray) -> tuple[FloatArray, FloatArray]:
    eigenvalues, eigenvectors = np.linalg.eigh(part.T @ part)
    kept = eigenvalues > 1e-10 * eigenvalues.max(initial=0.0)
    return part @ (eigenvectors[:, kept] / np.sqrt(eigenvalues[kept])), eigenvalues[kept]
