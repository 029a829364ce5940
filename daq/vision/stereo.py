"""From the beads of two images to points in space: epipolar candidates, triangulation, one partner for each.

The covariances carry the image noise alone: the calibration counts as exact. Errors of a calibration move all
points together and smoothly, so they show as an offset, a turn or a scale of the whole set.

Sources: Hartley and Zisserman, Multiple View Geometry, 2nd ed.: epipolar lines (9.1), Sampson distance
(11.4.3).
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from daq.vision.beads import Detections
from daq.vision.camera_model import PinholeCamera, StereoCalibration

FloatArray = NDArray[np.float64]

_REFINEMENTS = 4
_FORBIDDEN = 1e6  # px, the cost of a pair that a gate has refused


@dataclass(frozen=True, slots=True)
class Points:
    """Triangulated points.

    Attributes
    ----------
    positions : (n, 3) in the tissue frame, m
    covariances : (n, 3, 3) m²
    reprojection_px : (n,) rms distance between the measured and the reprojected pixels
    """

    positions: FloatArray
    covariances: FloatArray
    reprojection_px: FloatArray

    def select(self, rows: NDArray[np.bool_]) -> "Points":
        """Return the points of the marked rows (n,)."""
        return Points(self.positions[rows], self.covariances[rows], self.reprojection_px[rows])


@dataclass(frozen=True, slots=True)
class StereoSettings:
    """Gates of the stereo matching.

    Attributes
    ----------
    epipolar_px : largest distance of a bead from the epipolar line of its partner
    reprojection_px : largest rms reprojection error of a triangulated pair
    ambiguity_px : two pairings count as equally good if their epipolar distances differ by less
    radius_ratio : largest ratio of the radii of the two images of a bead
    lower, upper : opposite corners of the box in the tissue frame in which beads can be, m
    """

    epipolar_px: float = 1.0
    reprojection_px: float = 0.7
    ambiguity_px: float = 0.2
    radius_ratio: float = 1.5
    lower: tuple[float, float, float] = (-0.08, -0.08, -0.02)
    upper: tuple[float, float, float] = (0.12, 0.08, 0.03)


@dataclass(frozen=True, slots=True)
class StereoMatches:
    """Points seen by both cameras, the rows of their detections, and the rejections by reason."""

    points: Points
    left: NDArray[np.intp]
    right: NDArray[np.intp]
    rejected: Mapping[str, int]


def epipolar_distance_px(
    calibration: StereoCalibration, left_px: ArrayLike, right_px: ArrayLike
) -> FloatArray:
    """Return the Sampson distance (n, m), px, of every left pixel (n, 2) to every right pixel (m, 2)."""
    left, right = calibration.left, calibration.right
    left_rays = np.insert(left.undistort(left_px), 2, 1.0, axis=1)
    right_rays = np.insert(right.undistort(right_px), 2, 1.0, axis=1)
    R_right_left = right.R_cam_tissue @ left.R_cam_tissue.T
    x, y, z = right.to_camera(left.centre)
    essential = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) @ R_right_left
    lines_right, lines_left = left_rays @ essential.T, right_rays @ essential
    algebraic = lines_right @ right_rays.T
    gradient = (
        np.sum((lines_right[:, :2] / right.focal_length) ** 2, axis=1)[:, None]
        + np.sum((lines_left[:, :2] / left.focal_length) ** 2, axis=1)[None, :]
    )
    return np.abs(algebraic) / np.sqrt(gradient)


def triangulate(
    calibration: StereoCalibration,
    left_px: FloatArray,
    right_px: FloatArray,
    left_covariances: FloatArray,
    right_covariances: FloatArray,
) -> Points:
    """Return the points (n) whose images are nearest to the pixels in the sense of their covariances.

    Linear start (the point nearest to both rays), then Gauss-Newton on the reprojection error.

    Parameters
    ----------
    left_px, right_px : (n, 2) px
    left_covariances, right_covariances : (n, 2, 2) px²
    """
    cameras = (calibration.left, calibration.right)
    pixels = (left_px, right_px)
    informations = (_inverse(left_covariances), _inverse(right_covariances))
    positions = _nearest_to_rays(cameras, pixels)
    for _ in range(_REFINEMENTS):
        information, gradient, _ = _normal_equations(cameras, pixels, informations, positions)
        positions = positions - np.linalg.solve(information, gradient[..., None])[..., 0]
    information, _, squared_px = _normal_equations(cameras, pixels, informations, positions)
    return Points(positions, _inverse(information), np.sqrt(squared_px / 2.0))


def match(
    calibration: StereoCalibration, left: Detections, right: Detections, settings: StereoSettings
) -> StereoMatches:
    """Pair the beads of two images that were exposed together.

    A pair has to pass every gate; then each bead takes part in one pair at most, such that the sum of the
    epipolar distances is smallest. A pair is left out as ambiguous where another would be nearly as good for
    one of its beads.
    """
    rejected: Counter[str] = Counter()
    distances = epipolar_distance_px(calibration, left.centres, right.centres)
    ratios = left.radii[:, None] / right.radii[None, :]
    similar = np.maximum(ratios, 1.0 / ratios) <= settings.radius_ratio
    rows, columns = np.nonzero(similar & (distances <= settings.epipolar_px))
    candidates = triangulate(
        calibration,
        *(left.centres[rows], right.centres[columns]),
        *(left.covariances[rows], right.covariances[columns]),
    )
    inside = np.all(
        (candidates.positions >= settings.lower) & (candidates.positions <= settings.upper), axis=1
    )
    consistent = candidates.reprojection_px <= settings.reprojection_px
    rejected["outside the box"] = int(np.sum(~inside))
    rejected["reprojection"] = int(np.sum(inside & ~consistent))

    cost = np.full(distances.shape, _FORBIDDEN)
    possible = inside & consistent
    cost[rows[possible], columns[possible]] = distances[rows[possible], columns[possible]]
    assigned, ambiguous = _assign(cost, settings.ambiguity_px)
    rejected["ambiguous pair"] = int(np.sum(ambiguous))
    rejected["no partner"] = len(left) + len(right) - 2 * int(np.sum(assigned))
    keep = (assigned & ~ambiguous)[rows, columns]
    return StereoMatches(candidates.select(keep), rows[keep], columns[keep], +rejected)


def _assign(cost: FloatArray, margin: float) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the cheapest one-to-one assignment, and which of its pairs another pair comes near to, both (n, m)."""
    from scipy.optimize import linear_sum_assignment  # a recorder that starts need not wait for it

    cheapest = np.zeros(cost.shape, dtype=np.bool_)
    cheapest[linear_sum_assignment(cost)] = True
    rivals = np.where(cheapest, np.inf, cost)
    nearest_rival = np.minimum(
        rivals.min(axis=1, initial=np.inf)[:, None], rivals.min(axis=0, initial=np.inf)[None, :]
    )
    assigned = cheapest & (cost < _FORBIDDEN)
    return assigned, assigned & (nearest_rival < cost + margin)


def _nearest_to_rays(cameras: tuple[PinholeCamera, ...], pixels: tuple[FloatArray, ...]) -> FloatArray:
    """Return the points (n, 3) with the smallest sum of squared distances to the rays through the pixels."""
    normal_matrix, right_side = np.zeros((len(pixels[0]), 3, 3)), np.zeros((len(pixels[0]), 3))
    for camera, pixel in zip(cameras, pixels, strict=True):
        rays = camera.rays(pixel)
        across = np.eye(3) - rays[:, :, None] * rays[:, None, :]
        normal_matrix += across
        right_side += across @ camera.centre
    return (_inverse(normal_matrix) @ right_side[..., None])[..., 0]


def _normal_equations(
    cameras: tuple[PinholeCamera, ...],
    pixels: tuple[FloatArray, ...],
    informations: tuple[FloatArray, ...],
    positions: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return information matrix (n, 3, 3), gradient (n, 3) and squared reprojection error (n,), px²."""
    matrix, gradient = np.zeros((len(positions), 3, 3)), np.zeros((len(positions), 3))
    squared_px = np.zeros(len(positions))
    for camera, pixel, information in zip(cameras, pixels, informations, strict=True):
        projected, jacobian = camera.project_with_jacobian(positions)
        residual = projected - pixel
        weighted = jacobian.transpose(0, 2, 1) @ information
        matrix += weighted @ jacobian
        gradient += (weighted @ residual[..., None])[..., 0]
        squared_px += np.sum(residual**2, axis=1)
    return matrix, gradient, squared_px


def _inverse(matrices: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.inv(matrices), dtype=np.float64)
