"""The beads at rest against their design: how the design lies among them, and whether any are named wrongly.

The design is turned about the vertical in steps, laid on the beads, and refined by turns of assignment and rigid fit
(iterative closest point with a one-to-one assignment). A grid that looks alike in several orientations cannot tell
which one it has; then the one nearest to the expected orientation is taken and the others are told as rivals.

Sources: Besl and McKay, IEEE TPAMI 14(2), 1992; Kabsch, Acta Crystallographica A 32, 1976.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from daq.vision.errors import VisionError

FloatArray = NDArray[np.float64]
Indices = NDArray[np.intp]

_NONE = -1
_TURNS_DEG = tuple(range(0, 360, 15))
_ROUNDS = 20
_FEWEST = 4
_ALIKE = 1.5  # rms residuals within this ratio count as equally good
_SAME_TURN_DEG = 10.0


@dataclass(frozen=True, slots=True)
class GridMatch:
    """How a design lies among the beads that were found.

    Attributes
    ----------
    points : (n,) row of the bead that is each fiducial of the design, -1 where there is none
    turn_deg : of the beads against the design about z, -180 to 180
    shift_m : (3,) of the design's centre
    rms_m : distance that remains, of the named beads
    rivals_deg : other turns that fit as well; empty where the orientation is certain
    """

    points: Indices
    turn_deg: float
    shift_m: FloatArray
    rms_m: float
    rivals_deg: tuple[float, ...]

    @property
    def found(self) -> int:
        """How many fiducials have a bead."""
        return int(np.sum(self.points != _NONE))

    def describe(self) -> str:
        """Return one line."""
        shift = ", ".join(f"{1e3 * value:.1f}" for value in self.shift_m)
        turns = ", ".join(f"{turn:.0f}°" for turn in self.rivals_deg)
        rivals = f"; turns by {turns} fit as well" if turns else ""
        return (
            f"{self.found} of {len(self.points)} beads fit the design turned by {self.turn_deg:.1f}° and moved by "
            f"({shift}) mm, to {1e3 * self.rms_m:.2f} mm{rivals}"
        )


def match_grid(design: FloatArray, beads: FloatArray, expected_deg: float = 0.0) -> GridMatch:
    """Lay a design (n, 3) on beads (m, 3), m, in any orientation about z.

    Parameters
    ----------
    expected_deg : the orientation that is taken where several fit alike

    Raises
    ------
    VisionError
        There are fewer than four beads or fiducials.
    """
    if min(len(design), len(beads)) < _FEWEST:
        raise VisionError(
            f"rest grid: {len(beads)} beads for {len(design)} fiducials; {_FEWEST} of each are needed"
        )
    reach = 0.5 * _pitch(design)
    fits = [_laid(design, beads, np.radians(turn), reach) for turn in _TURNS_DEG]
    most = max(fit.found for fit in fits)
    full = [fit for fit in fits if fit.found == most]
    best_rms = min(fit.rms_m for fit in full)
    alike = [fit for fit in full if fit.rms_m <= _ALIKE * best_rms + 1e-9]
    chosen = min(alike, key=lambda fit: (_apart(fit.turn_deg, expected_deg), fit.rms_m))
    rivals: list[float] = []
    for fit in alike:
        if all(_apart(fit.turn_deg, known) > _SAME_TURN_DEG for known in (chosen.turn_deg, *rivals)):
            rivals.append(fit.turn_deg)
    return GridMatch(chosen.points, chosen.turn_deg, chosen.shift_m, chosen.rms_m, tuple(sorted(rivals)))


def mislabelled(design: FloatArray, named: FloatArray) -> dict[int, int]:
    """Return which fiducials (keys) carry the place of another one (values), from their positions (n, 3), m.

    NaN stands for one that was not seen. The positions may be moved and turned as a whole, and each bead may lie off
    its design by less than half of the grid's pitch.
    """
    seen = np.flatnonzero(np.isfinite(named).all(axis=1))
    laid = match_grid(design, named[seen])
    return {
        int(seen[point]): fiducial
        for fiducial, point in enumerate(laid.points.tolist())
        if point != _NONE and seen[point] != fiducial
    }


def _laid(design: FloatArray, beads: FloatArray, turn: float, reach: float) -> GridMatch:
    """Refine one orientation."""
    from scipy.optimize import linear_sum_assignment  # a recorder that starts need not wait for it

    rotation = Rotation.from_rotvec([0.0, 0.0, turn])
    middle = design.mean(axis=0)
    shift = beads.mean(axis=0)
    points = np.full(len(design), _NONE)
    residual = np.inf
    for _ in range(_ROUNDS):
        placed = rotation.apply(design - middle) + shift
        distances = np.linalg.norm(placed[:, None] - beads, axis=2)
        rows, columns = linear_sum_assignment(np.minimum(distances, 2.0 * reach))
        near = distances[rows, columns] < reach
        rows, columns = rows[near], columns[near]
        named = np.full(len(design), _NONE)
        named[rows] = columns
        residual = float(np.sqrt(np.mean(distances[rows, columns] ** 2))) if len(rows) else np.inf
        if len(rows) < _FEWEST or np.array_equal(named, points):
            points = named
            break
        points = named
        centre = design[rows].mean(axis=0)
        rotation, _ = Rotation.align_vectors(
            beads[columns] - beads[columns].mean(axis=0), design[rows] - centre
        )
        shift = beads[columns].mean(axis=0) + rotation.apply(middle - centre)
    x_axis = rotation.apply([1.0, 0.0, 0.0])
    turned_deg = float(np.degrees(np.arctan2(x_axis[1], x_axis[0])))
    return GridMatch(points, turned_deg, shift - middle, residual, ())


def _pitch(design: FloatArray) -> float:
    """Return the smallest distance between two fiducials, m."""
    distances = np.linalg.norm(design[:, None] - design, axis=2)
    np.fill_diagonal(distances, np.inf)
    return float(distances.min())


def _apart(a_deg: float, b_deg: float) -> float:
    return abs((a_deg - b_deg + 180.0) % 360.0 - 180.0)
