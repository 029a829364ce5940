"""Pinhole cameras with lens distortion, and the calibrated pair of them.

The tissue frame is the world: ``T_cam_tissue`` carries tissue coordinates to camera coordinates, whose x
points right in the image, y down and z along the optical axis. Pixel (0, 0) is the centre of the first
pixel, as in OpenCV.

Sources: Brown, "Close-range camera calibration", Photogrammetric Engineering 37(8), 1971; the coefficients'
order and signs are those of OpenCV's calib3d.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from daq import frames
from daq.files.toml_tables import TomlFile, toml_text
from robot_drivers.protocols import Pose

FloatArray = NDArray[np.float64]

_UNDISTORT_ITERATIONS = 20
_UNDISTORT_TOLERANCE = 1e-12


@dataclass(frozen=True, slots=True)
class PinholeCamera:
    """One camera: x_cam = R x_tissue + t, perspective division, distortion, then pixels.

    Attributes
    ----------
    width, height : image size, px
    focal_length : (fx, fy), px
    principal_point : (cx, cy), px
    distortion : (k1, k2, p1, p2, k3)
    T_cam_tissue : pose of the tissue frame in the camera frame, m
    """

    width: int
    height: int
    focal_length: tuple[float, float]
    principal_point: tuple[float, float]
    distortion: tuple[float, float, float, float, float]
    T_cam_tissue: Pose

    def __post_init__(self) -> None:
        if self.width < 1 or self.height < 1 or min(self.focal_length) <= 0:
            raise ValueError("width, height and focal_length must be positive")
        if abs(np.linalg.norm(self.T_cam_tissue.quaternion_wxyz) - 1.0) > 1e-3:
            raise ValueError("quaternion_wxyz of T_cam_tissue must have length 1")

    @classmethod
    def load(cls, path: Path) -> Self:
        """Read a calibration, by itself or as the ``result`` of a kept one; a RigError names line and key."""
        file = TomlFile.read(path)
        keys = ("result",) if "result" in file.root else ()
        return file.build(cls, file.root.get("result", file.root), keys)

    def save(self, path: Path) -> None:
        """Write a calibration file that :meth:`load` reads back exactly."""
        path.write_text(toml_text(self, path.parent), encoding="utf-8")

    @property
    def intrinsic_matrix(self) -> FloatArray:
        """K (3, 3), px."""
        (fx, fy), (cx, cy) = self.focal_length, self.principal_point
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    @property
    def R_cam_tissue(self) -> FloatArray:
        """Rotation matrix (3, 3) from tissue axes to camera axes."""
        return frames.rotation(self.T_cam_tissue.quaternion_wxyz).as_matrix()

    @property
    def centre(self) -> FloatArray:
        """Centre of projection in the tissue frame (3,), m."""
        return np.asarray(frames.inverse(self.T_cam_tissue).position)

    def to_camera(self, points: ArrayLike) -> FloatArray:
        """Carry points (..., 3) from the tissue frame to the camera frame, m."""
        in_camera: FloatArray = np.asarray(points) @ self.R_cam_tissue.T + self.T_cam_tissue.position
        return in_camera

    def project(self, points: ArrayLike) -> FloatArray:
        """Project tissue points (..., 3), m, to pixels (..., 2); NaN for points behind the camera."""
        normalised, _ = _divide(self.to_camera(points))
        return self.to_pixels(normalised)

    def project_with_jacobian(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Project as :meth:`project`, and return with it d pixel / d point (..., 2, 3), px/m."""
        normalised, by_camera = _divide(self.to_camera(points))
        return self.to_pixels(normalised), self.pixel_jacobian(normalised) @ by_camera @ self.R_cam_tissue

    def to_pixels(self, normalised: FloatArray) -> FloatArray:
        """Distort normalised image coordinates x/z, y/z (..., 2) and return their pixels (..., 2)."""
        return _distort(normalised, self.distortion) * self.focal_length + self.principal_point

    def pixel_jacobian(self, normalised: FloatArray) -> FloatArray:
        """Return d pixel / d normalised image coordinates (..., 2, 2)."""
        focal_length: FloatArray = np.array(self.focal_length)[:, None]
        return _distortion_jacobian(normalised, self.distortion) * focal_length

    def undistort(self, pixels: ArrayLike) -> FloatArray:
        """Return the normalised image coordinates x/z, y/z (..., 2) of pixels (..., 2), by Newton's method.

        NaN where the distortion has no inverse there.
        """
        target = (np.asarray(pixels, dtype=np.float64) - self.principal_point) / self.focal_length
        normalised = target.copy()
        for _ in range(_UNDISTORT_ITERATIONS):
            residual = _distort(normalised, self.distortion) - target
            if not np.any(np.abs(residual) > _UNDISTORT_TOLERANCE):
                break
            step = np.linalg.solve(_distortion_jacobian(normalised, self.distortion), residual[..., None])
            normalised = normalised - step[..., 0]
        converged = np.all(np.abs(residual) <= _UNDISTORT_TOLERANCE, axis=-1, keepdims=True)
        return np.where(converged, normalised, np.nan)

    def rays(self, pixels: ArrayLike) -> FloatArray:
        """Return unit vectors (..., 3) in the tissue frame from :attr:`centre` through pixels (..., 2)."""
        normalised = self.undistort(pixels)
        in_camera = np.concatenate([normalised, np.ones_like(normalised[..., :1])], axis=-1)
        directions: FloatArray = in_camera @ self.R_cam_tissue
        length: FloatArray = np.linalg.norm(directions, axis=-1, keepdims=True)
        return directions / length


@dataclass(frozen=True, slots=True)
class StereoCalibration:
    """Two cameras in one tissue frame; ``rms_px`` is the reprojection error of the calibration, px."""

    left: PinholeCamera
    right: PinholeCamera
    rms_px: float

    @property
    def baseline_m(self) -> float:
        """Distance of the two centres of projection, m."""
        return float(np.linalg.norm(self.right.centre - self.left.centre))

    @classmethod
    def load(cls, path: Path) -> Self:
        """Read a calibration, by itself or as the ``result`` of a kept one; a RigError names line and key."""
        file = TomlFile.read(path)
        keys = ("result",) if "result" in file.root else ()
        return file.build(cls, file.root.get("result", file.root), keys)

    def save(self, path: Path) -> None:
        """Write a calibration file that :meth:`load` reads back exactly."""
        path.write_text(toml_text(self, path.parent), encoding="utf-8")


def pose_looking_at(position: ArrayLike, target: ArrayLike, up: ArrayLike) -> Pose:
    """Return ``T_cam_tissue`` of a camera at ``position`` looking at ``target`` with ``up`` up in its image.

    All three (3,) in the tissue frame; the first two in m.
    """
    forward = np.subtract(target, position, dtype=np.float64)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, np.asarray(up, dtype=np.float64))
    right /= np.linalg.norm(right)
    R_tissue_cam = np.column_stack([right, np.cross(forward, right), forward])
    return frames.inverse(frames.pose(position, Rotation.from_matrix(R_tissue_cam)))


def _divide(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return x/z, y/z (..., 2) of camera points (..., 3) and its Jacobian (..., 2, 3); NaN where z <= 0."""
    depth = np.where(points[..., 2:] > 0.0, points[..., 2:], np.nan)
    normalised = points[..., :2] / depth
    jacobian = np.zeros((*points.shape[:-1], 2, 3))
    jacobian[..., 0, 0] = jacobian[..., 1, 1] = 1.0 / depth[..., 0]
    jacobian[..., :, 2] = -normalised / depth
    return normalised, jacobian


def _distort(normalised: FloatArray, distortion: tuple[float, float, float, float, float]) -> FloatArray:
    k1, k2, p1, p2, k3 = distortion
    x, y = normalised[..., 0], normalised[..., 1]
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return np.stack(
        [
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ],
        axis=-1,
    )


def _distortion_jacobian(
    normalised: FloatArray, distortion: tuple[float, float, float, float, float]
) -> FloatArray:
    k1, k2, p1, p2, k3 = distortion
    x, y = normalised[..., 0], normalised[..., 1]
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3))  # d radial / d r2, twice
    jacobian = np.empty((*x.shape, 2, 2))
    jacobian[..., 0, 0] = radial + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x
    jacobian[..., 1, 1] = radial + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x
    jacobian[..., 0, 1] = jacobian[..., 1, 0] = slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y
    return jacobian
