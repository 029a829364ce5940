"""Which point is which fiducial: first by the rest positions, then by following each one from image to image.

A fiducial is named only when one point, and no other, lies where it must be; else it stays unseen. Two
fiducials that exchange their names silently would look like tissue that tears.

The fiducials seen last are looked for where they were, as far around as they can have moved. Those found give
the motion of the surface, interpolated by an affine map weighted by distance. By that motion of its
neighbours each fiducial is carried along, and there it is named; one out of sight the less certainly the
farther it went. Once the search region comes near to half-way to a neighbour, or a neighbour can have come
into it since the last image, the fiducial is lost. The lost are found again when there is a place for every
point and a point for every place: a grid that moved on by a row has both left over.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from daq.vision.errors import VisionError
from daq.vision.rest_grid import match_grid

FloatArray = NDArray[np.float64]
Indices = NDArray[np.intp]

_NONE = -1
_HALF_WAY = 0.35  # of the distance to the nearest other fiducial
_DISTINCT = 3.0  # a second candidate has to be farther by this factor
_FEWEST_NEIGHBOURS = 4


@dataclass(frozen=True, slots=True)
class IdentitySettings:
    """How far fiducials may be from where they are expected.

    Attributes
    ----------
    placement_tolerance_m : at the first image, from the design's rest position
    may_be_hidden : how many fiducials may be lacking in the first image, and in one that recovers the lost
    max_speed_m_s : fastest motion of the tissue
    search_margin_m : what is added to every search region
    strain : how much the motion of a fiducial may differ from that of its neighbours, as a share of it
    """

    placement_tolerance_m: float = 0.004
    may_be_hidden: int = 2
    max_speed_m_s: float = 0.02
    search_margin_m: float = 0.001
    strain: float = 0.6


@dataclass(frozen=True, slots=True)
class Assignment:
    """The row of the point that is each fiducial (n,), -1 where unseen, and the rejections by reason."""

    points: Indices
    rejected: Mapping[str, int]


class IdentityTracker:
    """Names the points of consecutive images.

    Parameters
    ----------
    rest : (n, 3) the design's rest positions, tissue frame, m
    """

    def __init__(self, rest: ArrayLike, settings: IdentitySettings) -> None:
        self._rest = np.asarray(rest, dtype=np.float64)
        self._settings = settings
        self._positions = self._rest.copy()
        self._doubt = np.full(len(self._rest), settings.placement_tolerance_m)
        self._seen = np.zeros(len(self._rest), dtype=np.bool_)
        self._time_s: float | None = None

    def assign(self, points: FloatArray, time_s: float) -> Assignment:
        """Name the points (m, 3), m, of the images taken at ``time_s``; times ascend.

        Raises
        ------
        VisionError
            The first images lack more fiducials than may be hidden, or the images are not in order of time.
        """
        rejected: Counter[str] = Counter()
        if self._time_s is None:
            named = self._identify(points, rejected)
        elif time_s > self._time_s:
            named = self._follow(points, time_s - self._time_s, rejected)
        else:
            raise VisionError(
                f"images of {time_s:g} s come after those of {self._time_s:g} s; sort them by time"
            )
        self._time_s = time_s
        self._seen = named != _NONE
        self._positions[self._seen] = points[named[self._seen]]
        self._doubt[self._seen] = 0.0
        rejected["unclaimed point"] = len(points) - int(np.sum(self._seen))
        return Assignment(named, +rejected)

    def _identify(self, points: FloatArray, rejected: Counter[str]) -> Indices:
        tolerance, allowed = self._settings.placement_tolerance_m, self._settings.may_be_hidden
        named, rejected["ambiguous identity"] = _name(self._rest, np.full(len(self._rest), tolerance), points)
        missing = np.flatnonzero(named == _NONE)
        if len(missing) > allowed:
            raise VisionError(
                f"first images: no bead, or no single one, within {1e3 * tolerance:g} mm of the rest position of "
                f"fiducials {', '.join(map(str, missing))} ({len(points)} beads seen in both images, {allowed} may be "
                f"hidden{self._lie(points)}); check that the calibration is in the tissue frame, and uncover the beads"
            )
        return named

    def _lie(self, points: FloatArray) -> str:
        """Return how the design lies among the points, for whoever looks for the mistake."""
        try:
            return f"; {match_grid(self._rest, points).describe()}"
        except VisionError:
            return ""

    def _follow(self, points: FloatArray, elapsed_s: float, rejected: Counter[str]) -> Indices:
        settings = self._settings
        step = settings.max_speed_m_s * elapsed_s
        nearest = self._nearest()
        reach = np.minimum(settings.search_margin_m + step, _HALF_WAY * nearest)
        alone = self._seen & (step + reach < nearest)
        named, _ = _name(self._positions, np.where(alone, reach, 0.0), points)
        found = np.flatnonzero(named != _NONE)
        moved = points[named[found]] - self._positions[found]
        motions = np.zeros_like(self._positions)
        for fiducial in range(len(self._rest)):
            others = found != fiducial
            if np.sum(others) >= _FEWEST_NEIGHBOURS:
                motions[fiducial] = self._motion_at(fiducial, found[others], moved[others])
                self._doubt[fiducial] += settings.strain * float(np.linalg.norm(motions[fiducial]))
            else:
                self._doubt[fiducial] += step
        self._positions += motions
        reach = settings.search_margin_m + self._doubt
        widest = _HALF_WAY * self._nearest()
        lost = reach > widest
        named, rejected["ambiguous identity"] = _name(self._positions, np.where(lost, 0.0, reach), points)
        if not lost.any():
            return named
        recovered, _ = _name(self._positions, widest, points)
        if len(points) == np.sum(recovered != _NONE) >= len(self._rest) - settings.may_be_hidden:
            return recovered
        rejected["lost fiducial"] = int(np.sum(lost))
        return named

    def _nearest(self) -> FloatArray:
        """Return the distance of each fiducial from the nearest other (n,), m."""
        distances = np.linalg.norm(self._positions[:, None] - self._positions, axis=2)
        np.fill_diagonal(distances, np.inf)
        nearest: FloatArray = distances.min(axis=1)
        return nearest

    def _motion_at(self, fiducial: int, neighbours: Indices, moved: FloatArray) -> FloatArray:
        """Return the motion (3,) at a fiducial: the affine map of the motions (k, 3) of its neighbours."""
        offsets = self._rest[neighbours, :2] - self._rest[fiducial, :2]
        distances = np.linalg.norm(offsets, axis=1)
        weights = np.exp(-0.25 * (distances / distances.min()) ** 2)[:, None]
        design = np.column_stack([np.ones(len(neighbours)), offsets / distances.min()])
        coefficients = np.linalg.lstsq(weights * design, weights * moved, rcond=1e-3)[0]
        motion: FloatArray = coefficients[0]
        return motion


def _name(expected: FloatArray, reach: FloatArray, points: FloatArray) -> tuple[Indices, int]:
    """Return for each expected position (n, 3) the row of the one point (m, 3) within reach (n,), else -1.

    Point and fiducial have to be each other's nearest, with no second one nearly as near for either; the
    number of those that fail by this is returned with the rows.
    """
    distances = np.linalg.norm(expected[:, None] - points, axis=2)
    distances[distances >= reach[:, None]] = np.inf
    rival = np.minimum(_least_other(distances), _least_other(distances.T).T)
    certain = np.isfinite(distances) & (_DISTINCT * distances <= rival)
    named = np.full(len(expected), _NONE)
    rows, columns = np.nonzero(certain)
    named[rows] = columns
    return named, int(np.sum(np.isfinite(distances).any(axis=1) & (named == _NONE)))


def _least_other(values: FloatArray) -> FloatArray:
    """Return for every entry (n, m) the smallest other entry of its row, infinite where there is none."""
    padded = np.concatenate([values, np.full((len(values), 2), np.inf)], axis=1)
    least, second = np.partition(padded, 1, axis=1)[:, :2].T
    return np.where(values == least[:, None], second[:, None], least[:, None])
