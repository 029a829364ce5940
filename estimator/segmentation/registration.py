"""The rigid way from the image's frame to the tissue's: by fiducials, or by the surface itself, with its error."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.errors import InputError
from estimator.surfaces.queries import nearest
from estimator.surfaces.surface import Surface

FloatArray = NDArray[np.float64]

# Points that spread less than this share of their largest extent in a second direction lie on one line.
_LINE = 0.02
_ROUNDS, _FIRST_ROUNDS = 100, 20
_SETTLED_M = 1e-7
# Turns of the principal axes that keep them right-handed.
_TURNS = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=np.float64)
_MOST_POINTS, _FEW_POINTS = 2000, 400
# A mirrored fit that is better by this factor is no chance.
_MIRRORED = 0.3
# One start is better than another only where its points lie closer by this factor.
_CLEARLY = 0.8


@dataclass(frozen=True, eq=False)
class Registration:
    """Where the tissue frame is.

    Attributes
    ----------
    T_tissue_image : (4, 4) float64, m
    method : "fiducials" or "surface"
    points : (n, 3) float64, what was to be met, tissue frame, m
    reached : (n, 3) float64, where it came to lie
    left_out_m : (n,) float64, how far each fiducial lies off where all the others put it, m; empty for a surface
    remarks : what is doubtful
    """

    T_tissue_image: FloatArray
    method: str
    points: FloatArray
    reached: FloatArray
    left_out_m: FloatArray
    remarks: tuple[str, ...] = ()

    @property
    def distances_m(self) -> FloatArray:
        """How far each point (n,) lies off, m."""
        return np.asarray(np.linalg.norm(self.reached - self.points, axis=1))

    @property
    def rms_m(self) -> float:
        """Root of the mean square of that, m."""
        return float(np.sqrt(np.mean(self.distances_m**2)))


def registered_by_fiducials(image: FloatArray, tissue: FloatArray, source: str) -> Registration:
    """Return the rigid motion that brings points (n, 3) of the image to those of the tissue, m, by least squares.

    W. Kabsch, Acta Cryst. A32 (1976); mirrored solutions are excluded. How well a point is met that took no part is
    found by leaving out each in turn.

    Raises
    ------
    InputError
        There are less than three points, or they lie on a line.
    """
    if len(image) < 3:
        raise InputError(f"{source}: {len(image)} pairs of points; a registration takes three or more")
    for points, where in ((image, "image"), (tissue, "tissue")):
        spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        if spread[1] <= _LINE * spread[0]:
            raise InputError(f"{source}: the points of the {where} lie on a line; take some beside it")
    motion = _rigid(image, tissue)
    everyone = np.arange(len(image))
    left_out = [
        np.linalg.norm(_applied(_rigid(image[everyone != n], tissue[everyone != n]), image[n]) - tissue[n])
        if len(image) > 3
        else np.nan
        for n in everyone
    ]
    found = Registration(motion, "fiducials", tissue, _applied(motion, image), np.array(left_out))
    mirrored = _rms_mirrored(image, tissue)
    if len(image) > 3 and mirrored < _MIRRORED * found.rms_m:
        told = "mirrored, the points would fit far better: one of the two frames is left-handed, or an axis mistaken"
        return replace(found, remarks=(told,))
    return found


def registered_by_surface(
    surface: Surface, points: FloatArray, start: FloatArray | None = None
) -> Registration:
    """Return the rigid motion that brings a surface to points (n, 3) on it, tissue frame, m.

    Iterated closest points (P. Besl & N. McKay, IEEE PAMI 14, 1992), with the distance to the tangent plane (Y. Chen &
    G. Medioni, 1992). Without a start the principal axes are brought together, in each of the four ways.

    Raises
    ------
    InputError
        There are less than six points.
    """
    if len(points) < 6:
        raise InputError(f"{len(points)} points of the surface; a registration takes six or more")
    some, few = _thinned(points, _MOST_POINTS), _thinned(points, _FEW_POINTS)
    remarks = tuple[str, ...]()
    if start is None:
        begun = [_iterated(surface, few, one, _FIRST_ROUNDS) for one in _by_axes(surface, points)]
        off = np.array([_rms(surface, few, motion) for motion in begun])
        start = begun[int(np.argmin(off))]
        if np.sort(off)[0] > _CLEARLY * np.sort(off)[1]:
            remarks = (
                "two ways round fit about as well; give fiducials too, from which the search then starts",
            )
    motion = _iterated(surface, some, start, _ROUNDS)
    back = np.asarray(np.linalg.inv(motion), dtype=np.float64)
    _, foot = nearest(surface.corners, _applied(back, points))
    return Registration(motion, "surface", points, _applied(motion, foot), np.zeros(0), remarks)


def _applied(motion: FloatArray, points: FloatArray) -> FloatArray:
    return np.asarray(points @ motion[:3, :3].T + motion[:3, 3])


def _rigid(one: FloatArray, other: FloatArray) -> FloatArray:
    middle, goal = one.mean(axis=0), other.mean(axis=0)
    u, _, vt = np.linalg.svd((other - goal).T @ (one - middle))
    motion = np.eye(4)
    motion[:3, :3] = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    motion[:3, 3] = goal - motion[:3, :3] @ middle
    return motion


def _rms_mirrored(one: FloatArray, other: FloatArray) -> float:
    mirrored = other * (-1.0, 1.0, 1.0)
    off = _applied(_rigid(one, mirrored), one) - mirrored
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))


def _by_axes(surface: Surface, points: FloatArray) -> list[FloatArray]:
    weights, centres = surface.areas, surface.corners.mean(axis=1)
    middle = weights @ centres / weights.sum()
    spread = (centres - middle).T @ ((centres - middle) * weights[:, None])
    goal = points.mean(axis=0)
    axes, others = _right_handed(np.linalg.eigh(spread)[1]), np.linalg.eigh(np.cov(points.T))[1]
    motions = []
    for turn in _TURNS:
        motion = np.eye(4)
        motion[:3, :3] = _right_handed(others) @ np.diag(turn) @ axes.T
        motion[:3, 3] = goal - motion[:3, :3] @ middle
        motions.append(motion)
    return motions


def _right_handed(axes: FloatArray) -> FloatArray:
    return axes * (1.0, 1.0, np.sign(np.linalg.det(axes)))


def _iterated(surface: Surface, points: FloatArray, motion: FloatArray, rounds: int) -> FloatArray:
    """Move the points, back in the surface's frame, until they settle on it."""
    corners, normals = surface.corners, surface.area_vectors / surface.areas[:, None]
    back = np.asarray(np.linalg.inv(motion), dtype=np.float64)
    for _ in range(rounds):
        now = _applied(back, points)
        triangle, foot = nearest(corners, now)
        normal, middle = normals[triangle], now.mean(axis=0)
        size = float(np.linalg.norm(now - middle, axis=1).max())
        # a small turn in units of the size, so that turns and shifts weigh alike; what nothing holds, stays
        system = np.hstack([np.cross(now - middle, normal) / size, normal])
        step = np.linalg.lstsq(system, np.einsum("nx,nx->n", foot - now, normal), rcond=1e-6)[0]
        turn = np.eye(4)
        turn[:3, :3] = Rotation.from_rotvec(step[:3] / size).as_matrix()
        turn[:3, 3] = middle + step[3:] - turn[:3, :3] @ middle
        back = turn @ back
        if np.linalg.norm(step) < _SETTLED_M:
            break
    return np.asarray(np.linalg.inv(back))


def _thinned(points: FloatArray, most: int) -> FloatArray:
    return points[:: -(-len(points) // most)]


def _rms(surface: Surface, points: FloatArray, motion: FloatArray) -> float:
    now = _applied(np.asarray(np.linalg.inv(motion), dtype=np.float64), points)
    _, foot = nearest(surface.corners, now)
    return float(np.sqrt(np.mean(np.sum((foot - now) ** 2, axis=1))))
