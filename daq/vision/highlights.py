"""Highlights on glossy beads, fitted to all beads of an image together.

A highlight near the rim of a bead that is a few pixels wide looks much like a bead whose rim is elsewhere, the more
so out of focus: by itself such a bead tells its centre to a tenth of a pixel at best. What the beads of an image
have in common decides: one lamp and one lens make highlights of one width, and one tint in each plane of a
mosaic. So the width is moved by Newton's method on the summed loss, every bead's own parameters following it,
in turn with fits of these and of the tints.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from daq.vision.edge_model import (
    CENTRE,
    CONTRAST,
    GLOSSY_PARAMETERS,
    PLAIN_PARAMETERS,
    SPOT,
    SPOT_LEVEL,
    SPOT_WIDTH,
    Patches,
    half_axes,
    median,
    model,
)
from daq.vision.robust_fit import minimise, normal_equations, with_measured_scales

FloatArray = NDArray[np.float64]

_SIGNIFICANCE = 4.0
_START_WIDTH_PX = 0.9
_START_WIDTH_OF_RADIUS = 0.2
_ROUNDS = 3
_ITERATIONS = 4  # of a round
_LARGEST_STEP_PX = 0.4
_SMALLEST_WIDTH_PX = 0.5
_LARGEST_SPREAD = 1.5  # of the usual one, for a patch to tell what the highlights have in common
_TINY = 1e-12


def fit_highlights(
    plain: FloatArray, patches: Patches, planes: NDArray[np.intp]
) -> tuple[NDArray[np.intp], FloatArray, Patches]:
    """Find the beads with a highlight and fit them.

    Parameters
    ----------
    plain : (n, 10) parameters fitted without highlights
    patches : their pixels
    planes : (n, p) to which plane of the mosaic a pixel belongs; zeros on a monochrome sensor

    Returns
    -------
    rows : (m,) of the beads on which a highlight was found
    parameters : (m, 14)
    patches : theirs, with the tints found
    """
    start, rows = _suspected(plain, patches)
    patches, planes = patches.select(rows), planes[rows]
    glossy = minimise(start, patches, _ITERATIONS, free=SPOT_WIDTH)
    for _ in range(_ROUNDS - 1):
        telling = _plausible(glossy) & _clean(glossy, patches)
        glossy[:, SPOT_WIDTH] = _common_width(glossy, patches, telling)
        patches = with_measured_scales(glossy, _with_tints(glossy, patches, planes, telling))
        glossy = minimise(glossy, patches, _ITERATIONS, free=SPOT_WIDTH)
    found = _plausible(glossy)
    return rows[found], glossy[found], patches.select(found)


def _suspected(plain: FloatArray, patches: Patches) -> tuple[FloatArray, NDArray[np.intp]]:
    """Return start parameters (m, 14) of the beads that are brighter somewhere than the plain model, and their rows."""
    residuals, _ = model(plain, patches)
    radii = _radii(plain)
    distance = np.hypot(patches.x - plain[:, :1], patches.y - plain[:, 1:2])
    brightness = np.where(distance < 0.8 * radii[:, None], -residuals, 0.0)
    usual = 1.4826 * median(np.abs(residuals), patches.weights > 0.0)
    rows = np.flatnonzero(brightness.max(axis=1) > _SIGNIFICANCE * usual)
    peaks = rows, brightness[rows].argmax(axis=1)
    start = np.zeros((len(rows), GLOSSY_PARAMETERS))
    start[:, :PLAIN_PARAMETERS] = plain[rows]
    start[:, SPOT] = np.stack([patches.x[peaks], patches.y[peaks]], axis=1)
    start[:, SPOT_LEVEL] = brightness[peaks]
    start[:, SPOT_WIDTH] = _START_WIDTH_PX + _START_WIDTH_OF_RADIUS * radii[rows]
    return start, rows


def _plausible(glossy: FloatArray) -> NDArray[np.bool_]:
    offsets, radii = np.linalg.norm(glossy[:, SPOT] - glossy[:, CENTRE], axis=1), _radii(glossy)
    return (glossy[:, SPOT_LEVEL] > 0.0) & (offsets < radii) & (glossy[:, SPOT_WIDTH] < radii)


def _clean(glossy: FloatArray, patches: Patches) -> NDArray[np.bool_]:
    """Tell which patches show nothing but a bead: those that the model explains as well as it does most."""
    spreads = median(np.abs(model(glossy, patches)[0]), patches.weights > 0.0)
    return spreads <= _LARGEST_SPREAD * median(spreads[None], np.isfinite(spreads)[None])


def _common_width(glossy: FloatArray, patches: Patches, telling: NDArray[np.bool_]) -> FloatArray:
    """Return the widths (m,), all moved by one step of Newton's method on the loss of the ``telling`` beads."""
    hessian, gradient, _ = normal_equations(*model(glossy, patches), patches)
    own, width = slice(SPOT_WIDTH), SPOT_WIDTH
    # what remains of slope and curvature when every bead's own parameters follow
    follow = np.linalg.solve(
        hessian[:, own, own], np.stack([hessian[:, own, width], gradient[:, own]], axis=2)
    )
    held = np.stack([hessian[:, width, width], gradient[:, width]], axis=1)
    curvatures, slopes = (held - (hessian[:, width, None, own] @ follow)[:, 0]).T
    curvatures = np.maximum(curvatures, _TINY)
    step = _weighted_median(-(slopes / curvatures)[telling], curvatures[telling])
    widths = glossy[:, width] + np.clip(step, -_LARGEST_STEP_PX, _LARGEST_STEP_PX)
    return np.maximum(widths, _SMALLEST_WIDTH_PX)


def _with_tints(
    glossy: FloatArray, patches: Patches, planes: NDArray[np.intp], telling: NDArray[np.bool_]
) -> Patches:
    """Return the patches with the tints of beads and highlights that fit the ``telling`` ones best, plane by plane."""
    residuals, jacobian = model(glossy, patches)
    _, _, weights = normal_equations(residuals, jacobian, patches)
    # derivatives by the logarithms of both tints
    by_tints = np.stack(
        [glossy[:, [CONTRAST]] * jacobian[:, CONTRAST], glossy[:, [SPOT_LEVEL]] * jacobian[:, SPOT_LEVEL]],
        axis=1,
    )
    growths = np.ones((2, *planes.shape))
    for plane in np.unique(planes):
        pixels = planes == plane
        weighted = by_tints * np.where(pixels, weights, 0.0)[:, None]
        curvatures = weighted @ by_tints.transpose(0, 2, 1) + _TINY * np.eye(2)
        changes = -np.linalg.solve(curvatures, weighted @ residuals[..., None])[..., 0]
        for tint in range(2):
            importance = curvatures[telling, tint, tint]
            growths[tint][pixels] += _weighted_median(changes[telling, tint], importance)
    return replace(
        patches, bead_tints=patches.bead_tints * growths[0], spot_tints=patches.spot_tints * growths[1]
    )


def _weighted_median(values: FloatArray, weights: FloatArray) -> float:
    """Return the median of values (m,) of unequal weight, 0 of none: what is no bead does not move it."""
    if not len(values):
        return 0.0
    order = np.argsort(values)
    passed = np.cumsum(weights[order])
    return float(values[order[np.searchsorted(passed, 0.5 * passed[-1])]])


def _radii(parameters: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(half_axes(parameters).prod(axis=1)))
