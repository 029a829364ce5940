"""Measured displacements as a boundary: what the beads in a box did, made a function of place and of the gripper's way.

Both are polynomials of low order, fitted by least squares: noise of single points and rows averages out, which else
would strain the tissue at the boundary. The points are mostly those of an image or volume correlation (DIC, DVC) around
a region of interest, for which such boundaries were proposed as finite-element model updating came to full fields
(Avril et al., Exp. Mech. 48 (2008) 381).
"""

from collections.abc import Sequence
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.experiment import Experiment
from estimator.experiment.holds import AXES, Prescribed
from estimator.fem.boundary.prescribed import PowersOfWay, PrescribedMotion

FloatArray = NDArray[np.float64]

# An axis along which the gripper goes less than this share of its longest way is none of its way's.
_ASIDE = 0.02
_MOST_POWERS = 3
# Rows and points for each coefficient that is fitted to them.
_ROWS_EACH, _POINTS_EACH = 2, 3
_HIGHEST_ORDER = 3
# Places that spread by less than this share of the body do not tell how the motion changes that way.
_FLAT = 1e-3
# Of the longest edge: what is this near a box lies in it.
_MARGIN = 1e-6
# The points follow the gripper's way where what is left is less than this share of how far they went, or these
# deviations.
_OFF, _DEVIATIONS = 0.1, 5.0


def prescribed_motion(experiment: Experiment, points: FloatArray) -> PrescribedMotion | None:
    """Return the motion of nodes (n, 3), m, that beads prescribe; None where none is.

    Raises
    ------
    InputError
        A box holds too few beads or no node, or its beads do not follow the gripper's way.
    """
    if not experiment.prescribed:
        return None
    way = _way_of(experiment)
    terms = way.terms(experiment.position).T
    led = np.zeros((len(points), 3), dtype=bool)
    coefficients = np.zeros((len(points), 3, terms.shape[1]))
    for number, prescribed in enumerate(experiment.prescribed, start=1):
        nodes = prescribed.box.distance(points) <= _MARGIN * max(experiment.phantom.size_m)
        label = f"[[prescribed]] {number}"
        if not nodes.any():
            raise InputError(f"{label} box holds no tissue; correct it")
        for axis in (AXES.index(direction) for direction in prescribed.directions):
            led[nodes, axis] = True
            beads, by_bead = _fitted(experiment, prescribed, label, axis, terms)
            at_beads, at_nodes = _in_space(beads, points[nodes])
            coefficients[nodes, axis] = at_nodes @ np.linalg.lstsq(at_beads, by_bead)[0]
    return PrescribedMotion(led, way, coefficients[led])


def _fitted(
    experiment: Experiment, prescribed: Prescribed, label: str, axis: int, terms: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the places (b, 3) of the beads that tell the motion along an axis, and their coefficients (b, t)."""
    rest, seen = experiment.fiducials_rest, experiment.fiducials[:, :, axis]
    largest = np.abs(terms).max(axis=0)
    known = np.isfinite(seen).sum(axis=0) >= _ROWS_EACH * terms.shape[1]
    near = prescribed.box.distance(rest) <= prescribed.reach + _MARGIN * max(experiment.phantom.size_m)
    chosen = np.flatnonzero(near & known)
    if len(chosen) < _POINTS_EACH:
        raise InputError(
            f"{label} has {len(chosen)} beads in reach whose {AXES[axis]} was measured in enough rows; it takes "
            f"{_POINTS_EACH}: give it a longer reach"
        )
    moved = seen[:, chosen] - rest[chosen, axis]
    by_bead = np.array([_least_squares(terms / largest, column) for column in moved.T])
    left = np.nan_to_num(moved - terms / largest @ by_bead.T)
    off = float(np.sqrt(np.mean(left**2)))
    farthest = float(np.nanmax(np.abs(experiment.fiducials[:, chosen] - rest[chosen])))
    if off > max(_OFF * farthest, _DEVIATIONS * float(experiment.sensor.bead_std[axis])):
        raise InputError(
            f"{label}: its beads are off the gripper's way by {1e3 * off:.2g} mm along {AXES[axis]}, of "
            f"{1e3 * farthest:.2g} mm that they go; a boundary that moves by itself cannot be prescribed"
        )
    return rest[chosen], by_bead / largest


def _way_of(experiment: Experiment) -> PowersOfWay:
    """Return the axes of the gripper's way, the longest first, and the highest power along that."""
    origin = np.asarray(experiment.grasp.centre)
    way = experiment.position - origin
    _, size, axes = np.linalg.svd(way, full_matrices=False)
    if not size[0] > 0:
        raise InputError("[[prescribed]] takes a gripper that moves")
    axes = axes[size > _ASIDE * size[0]]
    stations = len(np.unique(np.round(way @ axes[0] / (np.abs(way).max() * _ASIDE))))
    return PowersOfWay(origin, axes, int(np.clip((stations - 1) // _ROWS_EACH, 1, _MOST_POWERS)))


def _in_space(beads: FloatArray, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the monomials of the highest order that so many beads (b, 3) determine, at them and at places (p, 3)."""
    middle, size = beads.mean(axis=0), np.ptp(beads, axis=0)
    spread = np.flatnonzero(size > _FLAT * size.max())
    at_beads, at_places = ((points - middle)[:, spread] / size[spread] for points in (beads, places))
    order = 0
    for higher in range(1, _HIGHEST_ORDER + 1):
        if len(beads) >= _POINTS_EACH * len(_exponents(len(spread), higher)) or higher == 1:
            order = higher
    exponents = _exponents(len(spread), order)
    return _monomials(at_beads, exponents), _monomials(at_places, exponents)


def _exponents(count: int, order: int) -> list[tuple[int, ...]]:
    """Return which of so many variables are multiplied in each monomial up to an order."""
    return [one for n in range(order + 1) for one in combinations_with_replacement(range(count), n)]


def _monomials(points: FloatArray, exponents: Sequence[tuple[int, ...]]) -> FloatArray:
    return np.column_stack([np.prod(points[:, list(one)], axis=1) for one in exponents])


def _least_squares(terms: FloatArray, column: FloatArray) -> FloatArray:
    known = np.isfinite(column)
    return np.asarray(np.linalg.lstsq(terms[known], column[known])[0])
