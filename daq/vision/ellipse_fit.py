"""Ellipses fitted to patches of an image by the elliptic edge model: outline, centre and its covariance."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from daq.vision.edge_model import (
    CENTRE,
    CONTRAST,
    PLAIN_PARAMETERS,
    SHARPNESS,
    SPOT_WIDTH,
    Patches,
    half_axes,
    model,
    start,
)
from daq.vision.highlights import fit_highlights
from daq.vision.robust_fit import minimise, normal_equations, with_measured_scales

FloatArray = NDArray[np.float64]

_PLAIN_ITERATIONS = 8
_ROBUST_ITERATIONS = 12
_NO_OUTLIERS = 1e4  # a Cauchy scale, DN, that amounts to least squares


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


def fit_ellipses(
    levels: FloatArray, weights: FloatArray, planes: NDArray[np.intp], centres: FloatArray, radii: FloatArray
) -> EllipseFits:
    """Fit one ellipse to every patch of an image.

    Parameters
    ----------
    levels : (n, h, w) grey levels, DN; h and w odd
    weights : (n, h, w), 0 for pixels to leave out
    planes : (n, h, w) to which plane of a colour mosaic a pixel belongs; zeros on a monochrome sensor
    centres : (n, 2) start, px from the middle of the patch
    radii : (n,) start, px
    """
    count, height, width = levels.shape
    flat = (count, height * width)
    rows, columns = np.indices((height, width), dtype=np.float64)
    patches = Patches(
        levels=levels.reshape(flat),
        weights=weights.reshape(flat),
        x=np.broadcast_to((columns - width // 2).ravel(), flat),
        y=np.broadcast_to((rows - height // 2).ravel(), flat),
        scales=np.full(flat, _NO_OUTLIERS),
        bead_tints=np.ones(flat),
        spot_tints=np.ones(flat),
    )
    begin = start(patches, centres, radii)
    counted = _counted_first(patches.weights)
    patches, planes = patches.take(counted), np.take_along_axis(planes.reshape(flat), counted, axis=1)
    plain = minimise(begin, patches, _PLAIN_ITERATIONS, free=PLAIN_PARAMETERS)
    robust_patches = with_measured_scales(plain, patches)
    robust = minimise(plain, robust_patches, _ROBUST_ITERATIONS, free=PLAIN_PARAMETERS)
    fits = _summary(robust, robust_patches, free=PLAIN_PARAMETERS)
    glossy, parameters, glossy_patches = fit_highlights(plain, patches, planes)
    fits.put(glossy, _summary(parameters, glossy_patches, free=SPOT_WIDTH))
    return fits


def _counted_first(weights: FloatArray) -> NDArray[np.intp]:
    """Return for every patch the pixels that count, before as many others as make all rows equally long.

    A window is a third of the square around it, and every pixel that is fitted costs some fifty evaluations.
    """
    counted = weights > 0.0
    most = int(counted.sum(axis=1).max(initial=1))
    return np.argsort(~counted, axis=1, kind="stable")[:, :most]


def _summary(parameters: FloatArray, patches: Patches, free: int) -> EllipseFits:
    residuals, jacobian = model(parameters, patches)
    hessian, _, weights = normal_equations(residuals, jacobian[:, :free], patches)
    robust = weights * patches.scales**2
    variances = np.sum(weights * residuals**2, axis=1) / np.sum(robust, axis=1)
    axes = half_axes(parameters)
    radii = np.sqrt(axes.prod(axis=1))
    return EllipseFits(
        centres=parameters[:, CENTRE],
        covariances=variances[:, None, None] * np.linalg.pinv(hessian, hermitian=True)[:, CENTRE, CENTRE],
        radii=radii,
        aspects=axes[:, 1] / axes[:, 0],
        blurs=radii / parameters[:, SHARPNESS],
        contrasts=parameters[:, CONTRAST],
        misfits=np.sqrt(np.sum(patches.weights * residuals**2, axis=1) / np.sum(patches.weights, axis=1)),
    )
