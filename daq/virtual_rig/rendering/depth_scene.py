"""What a depth camera tells of the phantom, or of a board that somebody holds: depth along its axis, in counts.

The phantom's top and the table stand still, as in its image; around a bead the skin is as high as the bead. To that
comes noise of each pixel, an error that stays the same in all images and changes over some pixels, and pixels that
know no depth. Both errors grow with the square of the depth.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from daq.frames import rotation
from daq.virtual_rig.rendering.scene import flea2_above
from daq.vision.camera_model import PinholeCamera
from robot_drivers.protocols import DepthScale, Pose

FloatArray = NDArray[np.float64]

_SKIN_PX = 12  # around a bead's image that is as high as the bead
_LARGEST_COUNT = 0xFFFF


@dataclass(frozen=True, slots=True)
class DepthSettings:
    """The errors of a depth camera.

    Attributes
    ----------
    noise_m : standard deviation of a pixel's depth, m
    fixed_m : that of the error that stays the same in all images, m
    fixed_px : over which that changes, px
    at_range_m : depth at which both hold, m
    unknown : share of the pixels that know no depth
    """

    noise_m: float = 1e-4
    fixed_m: float = 3e-5
    fixed_px: float = 12.0
    at_range_m: float = 0.4
    unknown: float = 0.02


def depth_above(range_m: float = 0.4) -> PinholeCamera:
    """Return a depth camera that looks straight down on the phantom: rectified, a region of 768 x 640 pixels."""
    above = flea2_above(range_m)
    return replace(
        above, width=768, height=640, principal_point=(386.5, 315.5), distortion=(0.0, 0.0, 0.0, 0.0, 0.0)
    )


class DepthScene:
    """Renders the depth images of one camera.

    Parameters
    ----------
    camera : where it stands and how it sees
    phantom_size : edges of the block, m; its centre is the origin of the tissue frame
    scale : in which it counts
    settings : its errors
    seed : of them
    """

    def __init__(
        self,
        camera: PinholeCamera,
        phantom_size: ArrayLike,
        scale: DepthScale,
        settings: DepthSettings,
        seed: int,
    ) -> None:
        self._camera, self._scale, self._settings, self._seed = camera, scale, settings, seed
        pixels = np.stack(np.meshgrid(np.arange(camera.width), np.arange(camera.height)), axis=-1)
        rays = camera.rays(pixels)
        self._per_depth: FloatArray = rays / (rays @ camera.R_cam_tissue[2])[..., None]
        self._fixed = self._fixed_error(np.random.default_rng((seed, 5)))
        length, width, height = np.asarray(phantom_size, dtype=np.float64)
        top = self._of_plane(np.array([0.0, 0.0, height / 2]), np.array([0.0, 0.0, 1.0]))
        table = self._of_plane(np.array([0.0, 0.0, -height / 2]), np.array([0.0, 0.0, 1.0]))
        on_top = camera.centre + top[..., None] * self._per_depth
        is_phantom = (np.abs(on_top[..., 0]) <= length / 2) & (np.abs(on_top[..., 1]) <= width / 2)
        self._at_rest = np.where(is_phantom, top, table)

    def render(self, beads: ArrayLike, exposure: int) -> NDArray[np.uint16]:
        """Return the counts (height, width) with beads at (n, 3), tissue frame, m; the same ``exposure`` is alike."""
        depth, camera = self._at_rest.copy(), self._camera
        points = np.asarray(beads, dtype=np.float64)
        for point, (column, row) in zip(points, camera.project(points), strict=True):
            if not np.isfinite([column, row]).all():
                continue
            rows, columns = (
                slice(max(0, round(middle) - _SKIN_PX), max(0, round(middle) + _SKIN_PX + 1))
                for middle in (row, column)
            )
            depth[rows, columns] = (point[2] - camera.centre[2]) / self._per_depth[rows, columns, 2]
        return self._counted(depth, exposure)

    def render_board(self, T_tissue_board: Pose, exposure: int) -> NDArray[np.uint16]:
        """Return the counts (height, width) of the plane of a board."""
        normal = rotation(T_tissue_board.quaternion_wxyz).as_matrix()[:, 2]
        return self._counted(self._of_plane(np.asarray(T_tissue_board.position), normal), exposure)

    def _of_plane(self, point: FloatArray, normal: FloatArray) -> FloatArray:
        depth: FloatArray = (normal @ (point - self._camera.centre)) / (self._per_depth @ normal)
        return depth

    def _fixed_error(self, rng: np.random.Generator) -> FloatArray:
        """Return the error that stays, (height, width), of standard deviation 1."""
        white = rng.standard_normal((self._camera.height, self._camera.width))
        smooth = np.asarray(cv2.GaussianBlur(white, (0, 0), self._settings.fixed_px), dtype=np.float64)
        error: FloatArray = smooth / smooth.std()
        return error

    def _counted(self, depth: FloatArray, exposure: int) -> NDArray[np.uint16]:
        settings, scale = self._settings, self._scale
        rng = np.random.default_rng((self._seed, 6, exposure))
        error = settings.noise_m * rng.standard_normal(depth.shape) + settings.fixed_m * self._fixed
        seen = depth + error * (depth / settings.at_range_m) ** 2
        counts = np.rint((seen - scale.offset_m) / scale.scale_m)
        known = (
            (depth > 0)
            & (counts > 0)
            & (counts <= _LARGEST_COUNT)
            & (rng.random(depth.shape) >= settings.unknown)
        )
        return np.where(known, counts, scale.invalid or 0).astype(np.uint16)
