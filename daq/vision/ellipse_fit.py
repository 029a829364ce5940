"""The elliptic edge model: a blurred dark or bright ellipse on a sloping surface, fitted to image patches.

With u = x - c and y = M u for a symmetric matrix M, the outline is |y| = 1 and the grey level

    g(x) = b + h·u + a Φ(s (1 - |y|)) + k exp(-|x - q|² / 2w²),

where Φ is the integral of the normal distribution, so that the edge has the profile of a straight edge under
Gaussian blur. The last term is the highlight on a glossy bead; it is fitted only where the residuals show
one. Parameters: centre c, shape M, sharpness s, level b and slope h of the surface, contrast a, and q, k, w
of the highlight.

All patches are fitted at once by Levenberg and Marquardt. Cauchy weights after a first round keep dirt from
pulling the centre (Huber and Ronchetti, Robust Statistics, 2nd ed., section 7.8).
"""

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

FloatArray = NDArray[np.float64]

_PLAIN_ITERATIONS = 8
_ROBUST_ITERATIONS = 12
_CONVERGED_PX = 1e-3
_CAUCHY_TUNING = 2.385  # 95 % efficient on normal residuals
_NO_OUTLIERS = 1e6  # a Cauchy scale, DN, that amounts to least squares
_SMALLEST_SPREAD = 0.5  # DN, of rounding and read noise
_HIGHLIGHT_SIGNIFICANCE = 4.0
_START_BLUR_PX = 0.9
_LEAST_DAMPING = 1e-9
_TINY = 1e-12

_CENTRE = slice(0, 2)
_M11, _M12, _M22, _SHARPNESS, _LEVEL, _SLOPE_X, _SLOPE_Y, _CONTRAST = range(2, 10)
_PLAIN_PARAMETERS = 10
_SPOT, _SPOT_LEVEL, _SPOT_WIDTH = slice(10, 12), 12, 13
_GLOSSY_PARAMETERS = 14


@dataclass(frozen=True, slots=True)
class EllipseFits:
    """Fitted ellipses, one row a patch.

    Attributes
    ----------
    centres : (n, 2) px from the middle of the patch, x right and y down
    covariances : (n, 2, 2) of the centres, px², as if the residuals were independent from pixel to pixel
    radii : (n,) geometric mean of the half axes, px
    aspects : (n,) longer over shorter axis
    blurs : (n,) standard deviation of the edge's blur, px
    contrasts : (n,) bead minus surface, DN
    misfits : (n,) rms residual, dirt included, DN
    """

    centres: FloatArray
    covariances: FloatArray
    radii: FloatArray
    aspects: FloatArray
    blurs: FloatArray
    contrasts: FloatArray
    misfits: FloatArray

    def put(self, rows: NDArray[np.intp], fits: "EllipseFits") -> None:
        """Write other fits into some rows of the arrays."""
        for attribute in fields(self):
            getattr(self, attribute.name)[rows] = getattr(fits, attribute.name)


@dataclass(frozen=True, slots=True)
class _Patches:
    """Levels (n, p) and weights (n, p) of the pixels at x, y (p,), px from the middle; Cauchy scales (n,), DN."""

    levels: FloatArray
    weights: FloatArray
    x: FloatArray
    y: FloatArray
    scales: FloatArray

    def select(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> "_Patches":
        return _Patches(self.levels[rows], self.weights[rows], self.x, self.y, self.scales[rows])


def fit_ellipses(
    levels: FloatArray, weights: FloatArray, centres: FloatArray, radii: FloatArray
) -> EllipseFits:
    """Fit one ellipse to every patch.

    Parameters
    ----------
    levels : (n, h, w) grey levels, DN; h and w odd
    weights : (n, h, w), 0 for pixels to leave out
    centres : (n, 2) start, px from the middle of the patch
    radii : (n,) start, px
    """
    count, height, width = levels.shape
    rows, columns = np.indices((height, width), dtype=np.float64)
    patches = _Patches(
        levels=levels.reshape(count, height * width),
        weights=weights.reshape(count, height * width),
        x=(columns - width // 2).ravel(),
        y=(rows - height // 2).ravel(),
        scales=np.full(count, _NO_OUTLIERS),
    )
    plain = _minimise(_start(patches, centres, radii), patches, _PLAIN_ITERATIONS)
    residuals, _ = _model(plain, patches)
    spreads = np.maximum(_SMALLEST_SPREAD, 1.4826 * _median(np.abs(residuals), patches.weights > 0.0))
    patches = replace(patches, scales=_CAUCHY_TUNING * spreads)
    fits = _summary(_minimise(plain, patches, _ROBUST_ITERATIONS), patches)
    glossy, glossy_fits = _fit_highlights(plain, -residuals / spreads[:, None], patches)
    fits.put(glossy, glossy_fits)
    return fits


def _start(patches: _Patches, centres: FloatArray, radii: FloatArray) -> FloatArray:
    """Refine level, contrast and radius by the area within which more than half of the contrast is reached."""
    distance = np.hypot(patches.x - centres[:, :1], patches.y - centres[:, 1:])
    level = _median(patches.levels, distance > 1.5 * radii[:, None] + 1.0)
    contrast = _median(patches.levels, distance < np.maximum(0.6 * radii[:, None], 1.0)) - level
    reached = (patches.levels - level[:, None]) * contrast[:, None] > 0.5 * contrast[:, None] ** 2
    areas = np.sum(reached & (distance < radii[:, None] + 2.0), axis=1)
    radii = np.sqrt(np.maximum(areas, 1) / np.pi)
    parameters = np.zeros((len(radii), _PLAIN_PARAMETERS))
    parameters[:, _CENTRE] = centres
    parameters[:, _M11] = parameters[:, _M22] = 1.0 / radii
    parameters[:, _SHARPNESS] = radii / _START_BLUR_PX
    parameters[:, _LEVEL], parameters[:, _CONTRAST] = level, contrast
    return parameters


def _fit_highlights(
    plain: FloatArray, brightness: FloatArray, patches: _Patches
) -> tuple[NDArray[np.intp], EllipseFits]:
    """Return the rows of the beads on which a highlight was found, and their fits.

    ``brightness`` (n, p) is the excess of the levels over the model ``plain``, in units of the usual residual.
    """
    radii = np.sqrt(_half_axes(plain).prod(axis=1))
    distance = np.hypot(patches.x - plain[:, :1], patches.y - plain[:, 1:2])
    brightness = np.where(distance < 0.8 * radii[:, None], brightness, 0.0)
    peaks = brightness.argmax(axis=1)
    suspected = brightness.max(axis=1) > _HIGHLIGHT_SIGNIFICANCE
    start = np.zeros((int(suspected.sum()), _GLOSSY_PARAMETERS))
    start[:, :_PLAIN_PARAMETERS] = plain[suspected]
    start[:, _SPOT] = np.stack([patches.x, patches.y], axis=1)[peaks[suspected]]
    start[:, _SPOT_LEVEL] = (brightness.max(axis=1) * patches.scales / _CAUCHY_TUNING)[suspected]
    start[:, _SPOT_WIDTH] = _START_BLUR_PX + 0.15 * radii[suspected]
    glossy = _minimise(start, patches.select(suspected), _ROBUST_ITERATIONS)
    offsets = np.linalg.norm(glossy[:, _SPOT] - glossy[:, _CENTRE], axis=1)
    found = (glossy[:, _SPOT_LEVEL] > 0.0) & (offsets < radii[suspected])
    found &= np.abs(glossy[:, _SPOT_WIDTH]) < 0.5 * radii[suspected]
    rows = np.flatnonzero(suspected)[found]
    return rows, _summary(glossy[found], patches.select(rows))


def _minimise(start: FloatArray, patches: _Patches, iterations: int) -> FloatArray:
    """Minimise the Cauchy loss from ``start`` (n, k) by Levenberg and Marquardt; returns new parameters.

    A patch leaves the iteration once its centre rests.
    """
    result = start.copy()
    active, parameters = np.arange(len(start)), start.copy()
    damping = np.full(len(start), 1e-3)
    residuals, jacobian = _model(parameters, patches)
    loss = _loss(residuals, patches)
    diagonal = np.arange(start.shape[1])
    for _ in range(iterations):
        robust, hessian = _normal_matrix(residuals, jacobian, patches)
        gradient = jacobian @ (robust * residuals)[..., None]
        hessian[:, diagonal, diagonal] *= 1.0 + damping[:, None]
        step = np.linalg.solve(hessian, gradient)[..., 0]
        trial = parameters - step
        trial_residuals, trial_jacobian = _model(trial, patches)
        trial_loss = _loss(trial_residuals, patches)
        better = trial_loss < loss
        parameters[better], loss[better] = trial[better], trial_loss[better]
        residuals[better], jacobian[better] = trial_residuals[better], trial_jacobian[better]
        damping = np.maximum(damping * np.where(better, 0.2, 10.0), _LEAST_DAMPING)
        result[active] = parameters
        moving = np.any(np.abs(step[:, _CENTRE]) >= _CONVERGED_PX, axis=1)
        if not moving.any():
            break
        active, parameters, damping, loss = active[moving], parameters[moving], damping[moving], loss[moving]
        residuals, jacobian, patches = residuals[moving], jacobian[moving], patches.select(moving)
    return result


def _model(parameters: FloatArray, patches: _Patches) -> tuple[FloatArray, FloatArray]:
    """Return the residuals model - level (n, p) and their Jacobian (n, k, p), k = 10 or, with highlight, 14."""
    x, y, columns = patches.x, patches.y, parameters.T[..., None]
    cx, cy, m11, m12, m22, sharpness, level, slope_x, slope_y, contrast = columns[:_PLAIN_PARAMETERS]
    u, v = x - cx, y - cy
    y1, y2 = m11 * u + m12 * v, m12 * u + m22 * v
    rho = np.maximum(np.sqrt(y1 * y1 + y2 * y2), _TINY)
    argument = sharpness * (1.0 - rho)
    profile = ndtr(argument)
    by_argument = contrast / np.sqrt(2.0 * np.pi) * np.exp(-0.5 * argument * argument)
    by_rho = -by_argument * sharpness / rho
    residuals = level + slope_x * u + slope_y * v + contrast * profile - patches.levels
    jacobian = np.empty((*parameters.shape, len(x)))
    jacobian[:, 0] = -by_rho * (m11 * y1 + m12 * y2) - slope_x
    jacobian[:, 1] = -by_rho * (m12 * y1 + m22 * y2) - slope_y
    jacobian[:, _M11] = by_rho * y1 * u
    jacobian[:, _M12] = by_rho * (y1 * v + y2 * u)
    jacobian[:, _M22] = by_rho * y2 * v
    jacobian[:, _SHARPNESS] = by_argument * (1.0 - rho)
    jacobian[:, _LEVEL] = 1.0
    jacobian[:, _SLOPE_X] = u
    jacobian[:, _SLOPE_Y] = v
    jacobian[:, _CONTRAST] = profile
    if parameters.shape[1] == _GLOSSY_PARAMETERS:
        qx, qy, spot_level, width = columns[_PLAIN_PARAMETERS:]
        du, dv = (x - qx) / width, (y - qy) / width
        squared = du * du + dv * dv
        shape = np.exp(-0.5 * squared)
        spot = spot_level * shape
        residuals += spot
        jacobian[:, 10] = spot * du / width
        jacobian[:, 11] = spot * dv / width
        jacobian[:, _SPOT_LEVEL] = shape
        jacobian[:, _SPOT_WIDTH] = spot * squared / width
    return residuals, jacobian


def _loss(residuals: FloatArray, patches: _Patches) -> FloatArray:
    scales = patches.scales[:, None]
    loss: FloatArray = np.sum(patches.weights * scales**2 * np.log1p((residuals / scales) ** 2), axis=1)
    return loss


def _normal_matrix(
    residuals: FloatArray, jacobian: FloatArray, patches: _Patches
) -> tuple[FloatArray, FloatArray]:
    """Return the Cauchy weights (n, p) and with them the Gauss-Newton Hessian (n, k, k)."""
    robust = patches.weights / (1.0 + (residuals / patches.scales[:, None]) ** 2)
    hessian = (jacobian * robust[:, None, :]) @ jacobian.transpose(0, 2, 1)
    # on dirt a parameter can be without any effect; it then stays where it is
    hessian[:, range(jacobian.shape[1]), range(jacobian.shape[1])] += _TINY
    return robust, hessian


def _summary(parameters: FloatArray, patches: _Patches) -> EllipseFits:
    residuals, jacobian = _model(parameters, patches)
    robust, hessian = _normal_matrix(residuals, jacobian, patches)
    variances = np.sum(robust * residuals**2, axis=1) / np.sum(robust, axis=1)
    axes = _half_axes(parameters)
    radii = np.sqrt(axes.prod(axis=1))
    return EllipseFits(
        centres=parameters[:, _CENTRE],
        covariances=variances[:, None, None] * np.linalg.pinv(hessian, hermitian=True)[:, _CENTRE, _CENTRE],
        radii=radii,
        aspects=axes[:, 1] / axes[:, 0],
        blurs=radii / parameters[:, _SHARPNESS],
        contrasts=parameters[:, _CONTRAST],
        misfits=np.sqrt(np.sum(patches.weights * residuals**2, axis=1) / np.sum(patches.weights, axis=1)),
    )


def _half_axes(parameters: FloatArray) -> FloatArray:
    """Return the shorter and the longer half axis (n, 2), px."""
    m11, m12, m22 = parameters[:, _M11], parameters[:, _M12], parameters[:, _M22]
    mean, deviation = 0.5 * (m11 + m22), np.hypot(0.5 * (m11 - m22), m12)
    inverse = np.abs(np.stack([mean + deviation, mean - deviation], axis=1))
    return np.sort(1.0 / np.maximum(inverse, _TINY), axis=1)


def _median(values: FloatArray, where: NDArray[np.bool_]) -> FloatArray:
    """Return the median of every row (n,) over the places that count."""
    median: FloatArray = np.nanmedian(np.where(where, values, np.nan), axis=1)
    return median
