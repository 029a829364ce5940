"""Fitting the edge model to many patches at once, by Levenberg and Marquardt with Cauchy's loss.

The loss keeps dirt from pulling the centre (Huber and Ronchetti, Robust Statistics, 2nd ed., section 7.8). Its scale
is measured apart for bead and surface: a surface has texture, so its pixels tell less than those of the bead.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from daq.vision.edge_model import CENTRE, CONTRAST, Patches, median, model

FloatArray = NDArray[np.float64]

_CONVERGED_PX = 1e-3
_CAUCHY_TUNING = 2.385  # 95 % efficient on normal residuals
_SMALLEST_SPREAD = 0.5  # DN, of rounding and read noise
_LEAST_DAMPING = 1e-9
_TINY = 1e-12


def minimise(start: FloatArray, patches: Patches, iterations: int, free: int) -> FloatArray:
    """Minimise the loss over the first ``free`` parameters from ``start`` (n, k); returns new parameters.

    A patch leaves the iteration once its centre rests.
    """
    result = start.copy()
    active, parameters = np.arange(len(start)), start.copy()
    damping = np.full(len(start), 1e-3)
    residuals, jacobian = model(parameters, patches)
    loss = _loss(residuals, patches)
    diagonal = np.arange(free)
    for _ in range(iterations):
        hessian, gradient, _ = normal_equations(residuals, jacobian[:, :free], patches)
        hessian[:, diagonal, diagonal] *= 1.0 + damping[:, None]
        step = np.linalg.solve(hessian, gradient[..., None])[..., 0]
        trial = parameters.copy()
        trial[:, :free] -= step
        trial_residuals, trial_jacobian = model(trial, patches)
        trial_loss = _loss(trial_residuals, patches)
        better = trial_loss < loss
        parameters[better], loss[better] = trial[better], trial_loss[better]
        residuals[better], jacobian[better] = trial_residuals[better], trial_jacobian[better]
        damping = np.maximum(damping * np.where(better, 0.2, 10.0), _LEAST_DAMPING)
        result[active] = parameters
        moving = np.any(np.abs(step[:, CENTRE]) >= _CONVERGED_PX, axis=1)
        if not moving.any():
            break
        active, parameters, damping, loss = active[moving], parameters[moving], damping[moving], loss[moving]
        residuals, jacobian, patches = residuals[moving], jacobian[moving], patches.select(moving)
    return result


def normal_equations(
    residuals: FloatArray, jacobian: FloatArray, patches: Patches
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return Gauss and Newton's Hessian (n, k, k) and gradient (n, k), and the Cauchy weights (n, p), 1/DN²."""
    weights = patches.weights / (patches.scales**2 + residuals**2)
    weighted = jacobian * weights[:, None, :]
    hessian = weighted @ jacobian.transpose(0, 2, 1)
    # on dirt a parameter can be without any effect; it then stays where it is
    diagonal = np.arange(jacobian.shape[1])
    hessian[:, diagonal, diagonal] += _TINY
    return hessian, (weighted @ residuals[..., None])[..., 0], weights


def with_measured_scales(parameters: FloatArray, patches: Patches) -> Patches:
    """Return the patches with the scales that the residuals of a fit show."""
    residuals, jacobian = model(parameters, patches)
    share = np.clip(jacobian[:, CONTRAST] / patches.bead_tints, 0.0, 1.0)
    size, counted = np.abs(residuals), patches.weights > 0.0
    on_bead, on_surface = (
        np.maximum(_SMALLEST_SPREAD, 1.4826 * median(size, counted & where))[:, None]
        for where in (share > 0.5, share <= 0.5)
    )
    variances = share * on_bead**2 + (1.0 - share) * on_surface**2
    return replace(patches, scales=_CAUCHY_TUNING * np.sqrt(variances))


def _loss(residuals: FloatArray, patches: Patches) -> FloatArray:
    loss: FloatArray = np.sum(patches.weights * np.log1p((residuals / patches.scales) ** 2), axis=1)
    return loss
