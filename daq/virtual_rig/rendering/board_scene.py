"""What a camera sees of a printed calibration board that somebody holds before a grey ground."""

from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from daq.frames import rotation
from daq.vision.camera_model import PinholeCamera
from daq.vision.charuco import CharucoBoard
from robot_drivers.protocols import Pose

_PX_PER_SQUARE = 64
_MARGIN_PX = 40
_RAY_GRID = 4  # px between the rays that are cast
_BLUR_PX = 1.2  # of the finer print, so that sampling it does not alias
_BLACK, _WHITE, _GROUND = 25.0, 216.0, 120.0
_NOISE_DN = 1.5


class BoardScene:
    """Renders one camera's images of a board."""

    def __init__(self, camera: PinholeCamera, board: CharucoBoard) -> None:
        self._camera = camera
        self._square_m = board.square_m
        margin = (_MARGIN_PX,) * 4
        print_px = cv2.copyMakeBorder(
            board.image(_PX_PER_SQUARE), *margin, cv2.BORDER_CONSTANT, value=(255.0,)
        )
        levels = _BLACK + (_WHITE - _BLACK) / 255.0 * print_px.astype(np.float32)
        self._print = cv2.GaussianBlur(levels, (0, 0), _BLUR_PX)

    def render(self, T_tissue_board: Pose, exposure: int) -> NDArray[np.uint8]:
        """Return the image (height, width); the same ``exposure`` number gives the same noise."""
        R_board_tissue = rotation(T_tissue_board.quaternion_wxyz).as_matrix().T
        centre = R_board_tissue @ (self._camera.centre - T_tissue_board.position)
        directions = self._directions @ R_board_tissue.T.astype(np.float32)
        range_m = -centre[2] / directions[..., 2]
        to_px = _PX_PER_SQUARE / self._square_m
        x, y = (
            ((centre[axis] + range_m * directions[..., axis]) * to_px - 0.5 + _MARGIN_PX).astype(np.float32)
            for axis in (0, 1)
        )
        seen = cv2.remap(self._print, x, y, cv2.INTER_LINEAR, borderValue=(_GROUND,))
        noise = np.random.default_rng((exposure, 3)).normal(0.0, _NOISE_DN, seen.shape)
        return np.clip(np.rint(seen + noise), 0, 255).astype(np.uint8)

    @cached_property
    def _directions(self) -> NDArray[np.float32]:
        """Unit vectors (height, width, 3) of the rays, tissue axes, between those of a coarse grid linear."""
        width, height = self._camera.width, self._camera.height
        columns, rows = (np.arange(0, size + _RAY_GRID, _RAY_GRID) for size in (width, height))
        coarse = self._camera.rays(np.stack(np.meshgrid(columns, rows), axis=-1)).astype(np.float32)
        y, x = np.indices((height, width), dtype=np.float32) / _RAY_GRID
        return np.asarray(cv2.remap(coarse, x, y, cv2.INTER_LINEAR), dtype=np.float32)
