"""The elliptic edge model: a blurred dark or bright ellipse with a highlight on a sloping surface.

With u = x - c and y = M u for a symmetric matrix M, the outline is |y| = 1 and the grey level

    g(x) = b + h·u + a α Φ(s (1 - |y|)) + k κ exp(-|x - q|² / 2w²),

where Φ is the integral of the normal distribution, so that the edge has the profile of a straight edge under
Gaussian blur, and the last term is the highlight on a glossy bead, blurred alike. Parameters: centre c, shape M,
sharpness s, level b and slope h of the surface, contrast a, and q, k, w of the highlight. On the mosaic of a
colour sensor whose planes are scaled to an equally bright surface, beads and highlights of another colour
differ from plane to plane by the tints α and κ; on a monochrome sensor both are 1.
"""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

FloatArray = NDArray[np.float64]

CENTRE = slice(0, 2)
_M11, _M12, _M22 = range(2, 5)
SHARPNESS, _LEVEL, _SLOPE_X, _SLOPE_Y, CONTRAST = range(5, 10)
PLAIN_PARAMETERS = 10
SPOT, SPOT_LEVEL, SPOT_WIDTH = slice(10, 12), 12, 13
GLOSSY_PARAMETERS = 14

_START_BLUR_PX = 0.9
_TINY = 1e-12


@dataclass(frozen=True, slots=True)
class Patches:
    """Pixels to fit, one row a patch.

    Attributes
    ----------
    levels : (n, p) DN
    weights : (n, p), 0 for pixels to leave out
    x, y : (n, p) px from the middle of the patch, right and down
    scales : (n, p) DN, from which size on a residual counts for less
    bead_tints, spot_tints : (n, p) α and κ
    """

    levels: FloatArray
    weights: FloatArray
    x: FloatArray
    y: FloatArray
    scales: FloatArray
    bead_tints: FloatArray
    spot_tints: FloatArray

    def select(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> "Patches":
        """Return some of the patches."""
        return Patches(*(getattr(self, attribute.name)[rows] for attribute in fields(self)))

    def take(self, pixels: NDArray[np.intp]) -> "Patches":
        """Return the patches with some of their pixels (n, q) only."""
        values = (getattr(self, attribute.name) for attribute in fields(self))
        return Patches(*(np.take_along_axis(value, pixels, axis=1) for value in values))


def model(parameters: FloatArray, patches: Patches) -> tuple[FloatArray, FloatArray]:
    """Return the residuals model - level (n, p) and their Jacobian (n, k, p), k = 10 or, with highlight, 14."""
    x, y, columns = patches.x, patches.y, parameters.T[..., None]
    cx, cy, m11, m12, m22, sharpness, level, slope_x, slope_y, contrast = columns[:PLAIN_PARAMETERS]
    u, v = x - cx, y - cy
    y1, y2 = m11 * u + m12 * v, m12 * u + m22 * v
    rho = np.maximum(np.sqrt(y1 * y1 + y2 * y2), _TINY)
    argument = sharpness * (1.0 - rho)
    profile = patches.bead_tints * ndtr(argument)
    by_argument = contrast * patches.bead_tints / np.sqrt(2.0 * np.pi) * np.exp(-0.5 * argument * argument)
    by_rho = -by_argument * sharpness / rho
    residuals = level + slope_x * u + slope_y * v + contrast * profile - patches.levels
    jacobian = np.empty((*parameters.shape, x.shape[1]))
    jacobian[:, 0] = -by_rho * (m11 * y1 + m12 * y2) - slope_x
    jacobian[:, 1] = -by_rho * (m12 * y1 + m22 * y2) - slope_y
    jacobian[:, _M11] = by_rho * y1 * u
    jacobian[:, _M12] = by_rho * (y1 * v + y2 * u)
    jacobian[:, _M22] = by_rho * y2 * v
    jacobian[:, SHARPNESS] = by_argument * (1.0 - rho)
    jacobian[:, _LEVEL] = 1.0
    jacobian[:, _SLOPE_X] = u
    jacobian[:, _SLOPE_Y] = v
    jacobian[:, CONTRAST] = profile
    if parameters.shape[1] == GLOSSY_PARAMETERS:
        qx, qy, spot_level, width = columns[PLAIN_PARAMETERS:]
        du, dv = (x - qx) / width, (y - qy) / width
        squared = du * du + dv * dv
        shape = patches.spot_tints * np.exp(-0.5 * squared)
        spot = spot_level * shape
        residuals += spot
        jacobian[:, 10] = spot * du / width
        jacobian[:, 11] = spot * dv / width
        jacobian[:, SPOT_LEVEL] = shape
        jacobian[:, SPOT_WIDTH] = spot * squared / width
    return residuals, jacobian


def start(patches: Patches, centres: FloatArray, radii: FloatArray) -> FloatArray:
    """Return parameters (n, 10): level, contrast and radius by the area with more than half of the contrast."""
    distance = np.hypot(patches.x - centres[:, :1], patches.y - centres[:, 1:])
    level = median(patches.levels, distance > 1.5 * radii[:, None] + 1.0)
    contrast = median(patches.levels, distance < np.maximum(0.6 * radii[:, None], 1.0)) - level
    reached = (patches.levels - level[:, None]) * contrast[:, None] > 0.5 * contrast[:, None] ** 2
    areas = np.sum(reached & (distance < radii[:, None] + 2.0), axis=1)
    radii = np.sqrt(np.maximum(areas, 1) / np.pi)
    parameters = np.zeros((len(radii), PLAIN_PARAMETERS))
    parameters[:, CENTRE] = centres
    parameters[:, _M11] = parameters[:, _M22] = 1.0 / radii
    parameters[:, SHARPNESS] = radii / _START_BLUR_PX
    parameters[:, _LEVEL], parameters[:, CONTRAST] = level, contrast
    return parameters


def half_axes(parameters: FloatArray) -> FloatArray:
    """Return the shorter and the longer half axis (n, 2), px."""
    m11, m12, m22 = parameters[:, _M11], parameters[:, _M12], parameters[:, _M22]
    mean, deviation = 0.5 * (m11 + m22), np.hypot(0.5 * (m11 - m22), m12)
    inverse = np.abs(np.stack([mean + deviation, mean - deviation], axis=1))
    return np.sort(1.0 / np.maximum(inverse, _TINY), axis=1)


def median(values: FloatArray, where: NDArray[np.bool_]) -> FloatArray:
    """Return the lower median of every row (n,) over the places that count; 0 where none does."""
    if not where.any():
        return np.zeros(len(values))
    ordered = np.sort(np.where(where, values, np.inf), axis=1)
    counts = where.sum(axis=1)
    middle = ordered[np.arange(len(values)), np.maximum(counts - 1, 0) // 2]
    return np.where(counts > 0, middle, 0.0)
