"""The evidence of a linearised hypothesis beside what every model misses: over floors, inexactness, anything smooth.

The misfit and the derivatives are whitened further by a discrepancy that forgives the signature its inexactness. Its
amplitude is integrated over a grid.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.evidence.discrepancy import ModelError, Moments, forgiven
from estimator.inference.laplace import Priors, evidence_of_gram, log_mean

FloatArray = NDArray[np.float64]


def log_evidence(
    moments: Moments, priors: Priors, error: ModelError, amplitude: tuple[float, float]
) -> float:
    """Return ln p(y | hypothesis) up to a constant, with a discrepancy of given amplitude.

    ``moments`` are those of the residual and, after it, of the derivatives by the parameters.
    """
    gram, log_determinant = forgiven(error, moments, amplitude)
    return evidence_of_gram(gram, priors) - 0.5 * log_determinant


def over_floors(moments: Moments, priors: Priors, error: ModelError) -> float:
    """Return ln p(y | hypothesis) up to a constant, over all floors of what every model misses."""
    return log_mean([log_evidence(moments, priors, error, floor) for floor in error.floors])


def marginal_evidence(
    moments: Moments, priors: Priors, error: ModelError, explained: FloatArray
) -> tuple[float, tuple[float, float]]:
    """Integrate the evidence of a named hypothesis over the floor and over the inexactness of its signature.

    Parameters
    ----------
    explained : (2,) root mean square of what the effect explains in wrench and fiducials, units of one value's noise

    Returns
    -------
    log_evidence : float
    inexactness : the most probable amplitude of what it misses, in wrench and fiducials
    """
    found = {}
    for share, floor in itertools.product(error.settings.inexact, error.floors):
        wrench, fiducials = (float(np.hypot(f, share * e)) for f, e in zip(floor, explained, strict=True))
        found[wrench, fiducials] = log_evidence(moments, priors, error, (wrench, fiducials))
    return log_mean(list(found.values())), max(found, key=lambda key: found[key])


def with_floor_borne_out(error: ModelError, moments: Moments, priors: Priors) -> ModelError:
    """Return a model error whose floor is the one of all floors that a misfit makes most probable."""
    return replace(
        error, floor=max(error.floors, key=lambda floor: log_evidence(moments, priors, error, floor))
    )


def unknown_evidence(moments: Moments, priors: Priors, error: ModelError) -> float:
    """Return the evidence of a smooth misfit of any size beyond the floor, over all floors."""
    settings = error.settings
    beyond = [
        pair for pair in itertools.product(settings.unknown, repeat=2) if max(pair) > settings.least_unknown
    ]
    found = [
        log_evidence(moments, priors, error, (float(np.hypot(wrench, w)), float(np.hypot(fiducials, f))))
        for (wrench, fiducials), (w, f) in itertools.product(error.floors, beyond)
    ]
    return log_mean(found)
