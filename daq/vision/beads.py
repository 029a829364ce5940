"""Finding beads in one image: candidates by contrast, centres by the elliptic edge model, gates that count.

The centre of the fitted ellipse is taken as the image of the bead's centre. For a flat disc of radius r at
range d that is wrong by about f (r/d)² sin(tilt), for a ball by less: below 0.005 px for 1.5 mm at 0.4 m
through an 8 mm lens.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from daq.vision.ellipse_fit import EllipseFits, fit_ellipses
from robot_drivers.cameras.pixel_formats import RawPixelFormat

FloatArray = NDArray[np.float64]

_SMOOTHING_PX = 1.0
_WINDOW = 1.5  # of the spot's radius: how far around it the pixels are fitted
_WINDOW_MARGIN_PX = 2.0
_BACKGROUND_WINDOW = 8.0  # of the largest radius


@dataclass(frozen=True, slots=True)
class BeadSettings:
    """What counts as a bead.

    Attributes
    ----------
    polarity : "dark" beads on a bright surface, or "bright" ones on a dark one
    pixel_format : of the images, as in :class:`robot_drivers.protocols.Frame`; mosaics are fitted without
        demosaicing
    radius_px : smallest and largest radius, px
    min_contrast : smallest difference of level between bead and surface, DN
    max_aspect : largest ratio of the axes
    most_candidates : how many are looked at closely, the darkest (or brightest) first, lest an image take
        seconds
    max_blur : largest width of the edge's blur, as a share of the radius
    max_misfit : largest rms residual of the fit, as a share of the contrast
    model_error_px : standard deviation that texture, highlights and the lens add to what the residuals tell
    """

    polarity: Literal["dark", "bright"] = "dark"
    pixel_format: RawPixelFormat = "mono8"
    radius_px: tuple[float, float] = (1.8, 9.0)
    min_contrast: float = 25.0
    max_aspect: float = 2.0
    most_candidates: int = 64
    max_blur: float = 0.6
    max_misfit: float = 0.15
    model_error_px: float = 0.02

    def __post_init__(self) -> None:
        if not 0.0 < self.radius_px[0] < self.radius_px[1] or self.min_contrast <= 0.0:
            raise ValueError("radius_px must ascend from above zero, and min_contrast be above zero")


@dataclass(frozen=True, slots=True)
class Detections:
    """The beads of one image.

    Attributes
    ----------
    centres : (n, 2) px
    covariances : (n, 2, 2) px²
    radii : (n,) px
    contrasts : (n,) DN, positive
    rejected : number of candidates that were no bead, by reason
    """

    centres: FloatArray
    covariances: FloatArray
    radii: FloatArray
    contrasts: FloatArray
    rejected: Mapping[str, int]

    def __len__(self) -> int:
        return len(self.centres)


def detect_beads(image: NDArray[np.uint8], settings: BeadSettings) -> Detections:
    """Find the beads of a raw image (height, width)."""
    rejected: Counter[str] = Counter()
    starts, radii = _candidates(image, settings, rejected)
    reach = int(np.ceil(_WINDOW * radii.max(initial=1.0) + _WINDOW_MARGIN_PX)) + 1
    middles = np.rint(starts).astype(np.intp)
    inside = np.all((middles >= reach) & (middles + reach < image.shape[::-1]), axis=1)
    _count(rejected, "border", ~inside)
    starts, radii, middles = starts[inside], radii[inside], middles[inside]

    fits = _fit(image, starts, radii, middles, reach, settings)
    contrasts = -fits.contrasts if settings.polarity == "dark" else fits.contrasts
    smallest, largest = settings.radius_px
    moved = np.linalg.norm(middles + fits.centres - starts, axis=1)
    bead = np.ones(len(starts), dtype=np.bool_)
    for reason, passed in (
        ("contrast", contrasts >= settings.min_contrast),
        ("size", (fits.radii >= smallest) & (fits.radii <= largest)),
        ("shape", fits.aspects <= settings.max_aspect),
        ("blur", (fits.blurs > 0.0) & (fits.blurs <= settings.max_blur * fits.radii)),
        ("misfit", (fits.misfits <= settings.max_misfit * contrasts) & (moved <= radii)),
    ):
        _count(rejected, reason, bead & ~passed)
        bead &= passed
    return Detections(
        centres=(middles + fits.centres)[bead],
        covariances=fits.covariances[bead] + settings.model_error_px**2 * np.eye(2),
        radii=fits.radii[bead],
        contrasts=contrasts[bead],
        rejected=rejected,
    )


def _fit(
    image: NDArray[np.uint8],
    starts: FloatArray,
    radii: FloatArray,
    middles: NDArray[np.intp],
    reach: int,
    settings: BeadSettings,
) -> EllipseFits:
    """Fit patches of 2 reach + 1 px around the ``middles`` (n, 2) of the spots at ``starts`` (n, 2)."""
    steps = np.arange(-reach, reach + 1)
    rows, columns = middles[:, 1, None, None] + steps[:, None], middles[:, 0, None, None] + steps
    distances = np.hypot(columns - starts[:, 0, None, None], rows - starts[:, 1, None, None])
    patches = image[rows, columns].astype(np.float64)
    windows = distances < _WINDOW * radii[:, None, None] + _WINDOW_MARGIN_PX
    planes = np.zeros(patches.shape, dtype=np.intp)
    if settings.pixel_format != "mono8":
        around = windows & (distances > radii[:, None, None] + 1.0)
        planes = rows % 2 * 2 + columns % 2
        patches = _equalise_mosaic(patches, planes, around)
    return fit_ellipses(patches, windows.astype(np.float64), planes, starts - middles, radii)


def _candidates(
    image: NDArray[np.uint8], settings: BeadSettings, rejected: Counter[str]
) -> tuple[FloatArray, FloatArray]:
    """Return centroids (n, 2) and radii (n,), px, of the spots that differ from their surroundings."""
    dark = image if settings.polarity == "dark" else cv2.bitwise_not(image)
    smallest, largest = settings.radius_px
    window = 2 * int(_BACKGROUND_WINDOW * largest / 2) + 1
    difference = cv2.subtract(cv2.blur(dark, (window, window)), cv2.GaussianBlur(dark, (0, 0), _SMOOTHING_PX))
    _, mask = cv2.threshold(difference, 0.75 * settings.min_contrast, 1, cv2.THRESH_BINARY)
    # in a smoothed image there is no room for 65 536 spots, and 16 bits are three times as fast
    _, _, boxes, centroids = cv2.connectedComponentsWithStats(mask, ltype=cv2.CV_16U)
    boxes, starts = boxes[1:], centroids[1:].astype(np.float64)
    width, height, area = (
        boxes[:, cv2.CC_STAT_WIDTH],
        boxes[:, cv2.CC_STAT_HEIGHT],
        boxes[:, cv2.CC_STAT_AREA],
    )
    radii: FloatArray = np.sqrt(area / np.pi)
    sized = (radii >= 0.7 * smallest) & (radii <= largest + 2.0 * _SMOOTHING_PX)
    compact = (np.maximum(width, height) <= 1.5 * settings.max_aspect * np.minimum(width, height)) & (
        area > 0.5 * width * height
    )
    _count(rejected, "size", ~sized)
    _count(rejected, "shape", sized & ~compact)
    starts, radii = starts[sized & compact], radii[sized & compact]
    columns, rows = np.rint(starts).astype(np.intp).T
    strongest_first = np.argsort(difference[rows, columns])[::-1]
    crowd = np.arange(len(starts)) >= settings.most_candidates
    _count(rejected, "crowd", crowd)
    return starts[strongest_first[~crowd]], radii[strongest_first[~crowd]]


def _equalise_mosaic(patches: FloatArray, planes: NDArray[np.intp], around: NDArray[np.bool_]) -> FloatArray:
    """Scale the four planes of a Bayer mosaic so that the surface ``around`` a bead is equally bright in each.

    ``planes`` (n, h, w) holds the plane, 0 to 3, of every pixel.
    """
    gains = np.ones_like(patches)
    for number in range(4):
        plane = planes == number
        level = np.sum(patches * (plane & around), axis=(1, 2)) / np.sum(plane & around, axis=(1, 2))
        gains /= np.where(plane, np.maximum(level, 1.0)[:, None, None], 1.0)
    brightness = np.sum(patches * around, axis=(1, 2)) / np.sum(around, axis=(1, 2))
    return patches * gains * brightness[:, None, None]


def _count(rejected: Counter[str], reason: str, candidates: NDArray[np.bool_]) -> None:
    if candidates.any():
        rejected[reason] += int(candidates.sum())
