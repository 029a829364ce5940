"""Which point is which fiducial: first by the rest positions, then by following each one from image to image.

A fiducial is named only when one point, and no other, lies where it must be; else it stays unseen. Two fiducials that
exchange their names silently would look like tissue that tears.

A fiducial in sight is looked for where it was, as far around as it can have moved. Those found give the motion of the
surface, interpolated by an affine map weighted by distance; against that motion each found point is checked, and by
that motion those out of sight are carried along, the less certainly the farther they go. Once the search region
reaches half-way to a neighbour the fiducial is lost, and stays unseen.
"""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from daq.vision.errors import VisionError

FloatArray = NDArray[np.float64]

_NONE = -1
_HALF_WAY = 0.45  # of the distance to the nearest other fiducial
_DISTINCT = 3.0  # a second candidate has to be farther by this factor
_FIELD_NEIGHBOURS = 4


@dataclass(frozen=True, slots=True)
class IdentitySettings:
    """How far fiducials may be from where they are expected.

    Attributes
    ----------
    placement_tolerance_m : at the first image, from the design's rest position
    may_be_hidden : how many fiducials the first image may lack
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

    points: NDArray[np.intp]
    rejected: Counter[str]


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
            The first images lack more fiducials than may be hidden.
        """
        rejected: Counter[str] = Counter()
        if self._time_s is None:
            named = self._identify(points, rejected)
        else:
            named = self._follow(points, time_s - self._time_s, rejected)
        self._time_s = time_s
        self._seen = named != _NONE
        self._positions[self._seen] = points[named[self._seen]]
        self._doubt[self._seen] = 0.0
        rejected["unclaimed point"] = len(points) - int(np.sum(self._seen))
        return Assignment(named, +rejected)

    def _identify(self, points: FloatArray, rejected: Counter[str]) -> Indices:
        tolerance, allowed = self._settings.placement_tolerance_m, self._settings.may_be_hidden
        named = _name(self._rest, np.full(len(self._rest), tolerance), points, rejected)
        missing = np.flatnonzero(named == _NONE)
        if len(missing) > allowed:
            raise VisionError(
                f"first images: no bead, or no single one, within {1e3 * tolerance:g} mm of the rest position of "
                f"fiducials {', '.join(map(str, missing))} ({len(points)} beads seen in both images, {allowed} may be "
                "hidden); check that the calibration is in the tissue frame, and uncover the beads"
            )
        return named

    def _follow(self, points: FloatArray, elapsed_s: float, rejected: Counter[str]) -> Indices:
        settings = self._settings
        step = settings.max_speed_m_s * elapsed_s
        reach = np.where(self._seen, settings.search_margin_m + step, 0.0)
        named = _name(self._positions, np.minimum(reach, self._half_way()), points, rejected)
        found = np.flatnonzero(named != _NONE)
        moved = np.zeros_like(self._positions)
        moved[found] = points[named[found]] - self._positions[found]
        taken = np.zeros(len(points), dtype=np.bool_)
        taken[named[found]] = True

        for fiducial in range(len(self._rest)):
            neighbours = found[found != fiducial]
            if len(neighbours) < _FEWEST_NEIGHBOURS:
                self._doubt[fiducial] += step
                continue
            motion = self._motion_at(fiducial, neighbours, moved)
            uncertainty = settings.strain * float(np.linalg.norm(motion))
            if named[fiducial] == _NONE:
                self._positions[fiducial] += motion
                self._doubt[fiducial] += uncertainty
            elif np.linalg.norm(moved[fiducial] - motion) > settings.search_margin_m + uncertainty:
                named[fiducial] = _NONE
                self._positions[fiducial] += motion
                self._doubt[fiducial] += uncertainty
                rejected["inconsistent motion"] += 1
        return self._find_again(points, named, taken, rejected)

    def _find_again(
        self, points: FloatArray, named: Indices, taken: NDArray[np.bool_], rejected: Counter[str]
    ) -> Indices:
        """Name the points that are left as the fiducials that were out of sight."""
        reach = self._settings.search_margin_m + self._doubt
        searched = (named == _NONE) & (reach <= self._half_way())
        rejected["lost fiducial"] = int(np.sum((named == _NONE) & ~searched))
        left = np.flatnonzero(~taken)
        again = _name(self._positions, np.where(searched, reach, 0.0), points[left], rejected)
        return np.where((named == _NONE) & (again != _NONE), left[again], named) if len(left) else named

    def _half_way(self) -> FloatArray:
        """Return for each fiducial the share of the distance to the nearest other that may be searched (n,), m."""
        distances = np.linalg.norm(self._positions[:, None] - self._positions, axis=2)
        np.fill_diagonal(distances, np.inf)
        nearest: FloatArray = distances.min(axis=1)
        return _HALF_WAY * nearest

    def _motion_at(self, fiducial: int, neighbours: Indices, moved: FloatArray) -> FloatArray:
        """Return the motion (3,) at a fiducial by the affine map of its neighbours' motions, nearer ones heavier."""
        offsets = self._rest[neighbours, :2] - self._rest[fiducial, :2]
        distances = np.linalg.norm(offsets, axis=1)
        weights = np.exp(-0.25 * (distances / distances.min()) ** 2)[:, None]
        design = np.column_stack([np.ones(len(neighbours)), offsets / distances.min()])
        coefficients = np.linalg.lstsq(weights * design, weights * moved[neighbours], rcond=1e-3)[0]
        motion: FloatArray = coefficients[0]
        return motion


def _name(expected: FloatArray, reach: FloatArray, points: FloatArray, rejected: Counter[str]) -> Indices:
    """Return for each expected position (n, 3) the row of the one point (m, 3) within reach (n,), else -1.

    Point and fiducial have to be each other's nearest, with no second one nearly as near for either.
    """
    if not len(points):
        return np.full(len(expected), _NONE)
    distances = np.linalg.norm(expected[:, None] - points, axis=2)
    distances[distances > reach[:, None]] = np.inf
    nearest = distances.argmin(axis=1)
    best = distances.min(axis=1)
    alone = _DISTINCT * best <= _second_smallest(distances, axis=1)
    alone &= _DISTINCT * best <= np.where(
        distances[:, nearest].T.argmin ...
    )
