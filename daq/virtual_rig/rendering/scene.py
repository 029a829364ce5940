"""What a camera sees of the phantom: beads on a textured surface, through a lens, on a noisy sensor.

Rays are cast to the beads and to the surface, pixels are area-sampled, the lens blurs and shades, and the
sensor adds shot and read noise. Surface and table stand still: only the beads move, for only they are
measured. The noise around a bead is new in every image; elsewhere one of a few noisy backgrounds rendered
beforehand is taken, so that an image costs milliseconds. A bead that stands costs nothing but its noise.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from daq.vision.camera_model import PinholeCamera, StereoCalibration, pose_looking_at

FloatArray = NDArray[np.float64]
Patch = tuple[slice, slice]

_BACKGROUNDS = 6
_SUBPIXELS = 3
_BLUR_REACH = 4.0  # standard deviations
_KEPT_BEADS = 64
_RAY_GRID = 4  # px between the rays that are cast to the surface
_TEXTURE_SEED = 20
_TEXTURE_PITCH_M = 2.5e-4
_AMBIENT_LIGHT = 0.6
_TOWARDS_LIGHT = np.array([0.36, 0.48, 0.8])
_GLARE_WIDTH = 0.25  # standard deviation, of the bead's radius
_SURFACE_COLOUR = (1.0, 0.78, 0.66)  # red, green, blue as the sensor sees them
_BEAD_COLOUR = (0.85, 0.9, 1.0)


@dataclass(frozen=True, slots=True)
class SceneSettings:
    """The phantom, its beads, the light and the sensor.

    Attributes
    ----------
    phantom_size : edges of the block, m; its centre is the origin of the tissue frame
    bead_shape : "disc", painted flat on the surface, or "sphere", a ball on it whose outline is seen whole
    bead_diameter : m
    bead_reflectance, surface_reflectance, table_reflectance : share of full white, 0 to 1
    texture : standard deviation of the surface's reflectance, as a share of it
    blur : standard deviation of the lens blur, px
    vignetting : loss of light in the corners, as a share
    shading : change of light across the width of the image, as a share
    glare : level of the light that a bead mirrors, as a share of full white; 0 for none
    white_level : grey level of full white, DN
    electrons_per_dn : conversion gain of the sensor, which sets the shot noise
    read_noise : DN
    pixel_format : "mono8", or "bayer_rggb8" for the colour sensor's mosaic
    """

    phantom_size: tuple[float, float, float] = (0.1, 0.1, 0.01)
    bead_shape: Literal["disc", "sphere"] = "disc"
    bead_diameter: float = 0.0015
    bead_reflectance: float = 0.1
    surface_reflectance: float = 0.6
    table_reflectance: float = 0.5
    texture: float = 0.03
    blur: float = 0.8
    vignetting: float = 0.25
    shading: float = 0.15
    glare: float = 0.0
    white_level: float = 230.0
    electrons_per_dn: float = 70.0
    read_noise: float = 1.0
    pixel_format: Literal["mono8", "bayer_rggb8"] = "mono8"


def flea2_pair(baseline_m: float = 0.175, range_m: float = 0.4) -> StereoCalibration:
    """Return two FL2G-13S2C (1288 x 964 pixels of 3.75 µm) with 8 mm lenses that converge on the phantom.

    They stand above its anchored half, side by side along y, clear of a gripper that comes from +x.
    """
    focal_length = 8.0e-3 / 3.75e-6
    back = 0.3 * range_m
    height = float(np.sqrt(range_m**2 - back**2 - (baseline_m / 2) ** 2))
    left, right = (
        PinholeCamera(
            width=1288,
            height=964,
            focal_length=(focal_length, focal_length),
            principal_point=(643.5 + decentring, 481.5 - decentring),
            distortion=(-0.12, 0.1, 4e-4, -3e-4, 0.0),
            T_cam_tissue=pose_looking_at((-back, y, height), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
        )
        for y, decentring in ((baseline_m / 2, 6.0), (-baseline_m / 2, -9.0))
    )
    return StereoCalibration(left, right, rms_px=0.0)


def flea2_above(range_m: float = 0.4) -> PinholeCamera:
    """Return one camera as those of :func:`flea2_pair` that looks straight down on the middle of the phantom."""
    looking_down = pose_looking_at((0.0, 0.0, range_m), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    return replace(flea2_pair(range_m=range_m).left, T_cam_tissue=looking_down)


class Scene:
    """Renders the images of one camera.

    Parameters
    ----------
    camera : where it stands and how it sees
    settings : the phantom, its beads, the light and the sensor
    seed : of the noise; two cameras need two seeds
    """

    def __init__(self, camera: PinholeCamera, settings: SceneSettings, seed: int) -> None:
        self._camera = camera
        self._settings = settings
        self._seed = seed
        self._normal = camera.R_cam_tissue[:, 2]
        self._towards_light = camera.R_cam_tissue @ _TOWARDS_LIGHT
        self._white = _white(camera, settings)
        self._surface = _surface_reflectance(camera, settings) * self._white
        self._surface_colour = _mosaic(_SURFACE_COLOUR, camera, settings)
        self._bead_colour = _mosaic(_BEAD_COLOUR, camera, settings)
        rng = np.random.default_rng((seed, 0))
        background = _blur(self._surface, settings.blur) * self._surface_colour
        self._backgrounds = [_digitise(background, settings, rng) for _ in range(_BACKGROUNDS)]
        self._around_bead = lru_cache(_KEPT_BEADS)(self._rendered_bead)

    def render(self, positions: ArrayLike, exposure: int) -> NDArray[np.uint8]:
        """Return the image (height, width) of beads centred at ``positions`` (n, 3) in the tissue frame, m.

        A bead is left out where its position is NaN or its image would touch the border. The same
        ``exposure`` number gives the same noise.
        """
        rng = np.random.default_rng((self._seed, 1, exposure))
        image = self._backgrounds[rng.integers(_BACKGROUNDS)].copy()
        centres = self._camera.to_camera(positions)
        for centre in centres[np.isfinite(centres).all(axis=1) & (centres[:, 2] > 0.0)]:
            if (rendered := self._around_bead(*centre.tolist())) is not None:
                patch, level = rendered
                image[patch] = _digitise(level, self._settings, rng)
        return image

    def _rendered_bead(self, x: float, y: float, z: float) -> tuple[Patch, FloatArray] | None:
        """Return where in the image a bead is and the mean levels there, DN, None where that touches the border.

        The bead's centre is in the camera frame, m.
        """
        settings, camera = self._settings, self._camera
        centre = np.array([x, y, z])
        normalised = centre[:2] / centre[2]
        pixel = camera.to_pixels(normalised)
        column, row = (round(coordinate) for coordinate in pixel.tolist())
        margin = int(np.ceil(_BLUR_REACH * settings.blur))
        reach = int(np.ceil(settings.bead_diameter / 2 * camera.focal_length[0] / centre[2])) + margin + 1
        border = reach + margin
        if not (border <= row < camera.height - border and border <= column < camera.width - border):
            return None
        patch = _square(row, column, border)
        rays = _rays(normalised, camera.pixel_jacobian(normalised), np.array([column, row]) - pixel, border)
        coverage, reflectance = self._bead(centre, rays)
        surface = _blur(self._surface[patch] * (1.0 - coverage), settings.blur) * self._surface_colour[patch]
        bead = _blur(self._white[patch] * reflectance, settings.blur) * self._bead_colour[patch]
        inner = slice(margin, -margin)
        return _square(row, column, reach), (surface + bead)[inner, inner]

    def _bead(self, centre: FloatArray, rays: tuple[FloatArray, FloatArray]) -> tuple[FloatArray, FloatArray]:
        """Return for every pixel the share of it that the bead covers, and the light that the bead reflects.

        ``centre`` (3,) in the camera frame, m; ``rays`` the x/z and y/z of every subpixel.
        """
        settings, radius = self._settings, self._settings.bead_diameter / 2
        x, y = rays
        squared = x * x + y * y + 1.0
        along_centre = _dot(rays, centre)
        if settings.bead_shape == "disc":
            depth = self._normal @ centre / _dot(rays, self._normal)
        else:
            depth = along_centre / squared
        # where the ray meets the disc's plane, or passes the ball's centre
        distance = np.sqrt(depth * (depth * squared - 2.0 * along_centre) + centre @ centre)
        subpixel = centre[2] / self._camera.focal_length[0] / _SUBPIXELS
        coverage = np.clip(0.5 + (radius - distance) / subpixel, 0.0, 1.0)
        towards_camera = -centre / np.linalg.norm(centre)
        if settings.bead_shape == "disc":
            facing = np.full_like(x, self._normal @ self._towards_light)
        else:
            height = np.sqrt(np.maximum(0.0, 1.0 - (distance / radius) ** 2))
            sideways = (depth * _dot(rays, self._towards_light) - centre @ self._towards_light) / radius
            facing = np.maximum(0.0, sideways + height * (towards_camera @ self._towards_light))
        reflected = settings.bead_reflectance * (_AMBIENT_LIGHT + (1.0 - _AMBIENT_LIGHT) * facing) * coverage
        if settings.glare:
            halfway = self._towards_light + towards_camera
            spot = centre + radius * halfway / np.linalg.norm(halfway)
            miss_squared = spot @ spot - _dot(rays, spot) ** 2 / squared
            reflected += settings.glare * np.exp(-0.5 * miss_squared / (_GLARE_WIDTH * radius) ** 2)
        return _mean_of_subpixels(coverage), _mean_of_subpixels(reflected)


def _rays(
    normalised: FloatArray, pixel_jacobian: FloatArray, offset: FloatArray, reach: int
) -> tuple[FloatArray, FloatArray]:
    """Return x/z and y/z of the subpixels of a patch, over which the lens counts as linear.

    The patch extends ``reach`` px from its middle pixel, which lies ``offset`` px from the image of
    ``normalised``.
    """
    steps = (np.arange((2 * reach + 1) * _SUBPIXELS) + 0.5) / _SUBPIXELS - reach - 0.5
    columns, rows = steps[None, :] + offset[0], steps[:, None] + offset[1]
    (xx, xy), (yx, yy) = np.linalg.inv(pixel_jacobian).tolist()
    x, y = normalised.tolist()
    return x + xx * columns + xy * rows, y + yx * columns + yy * rows


def _dot(rays: tuple[FloatArray, FloatArray], vector: FloatArray) -> FloatArray:
    along: FloatArray = vector[0] * rays[0] + vector[1] * rays[1] + vector[2]
    return along


def _square(row: int, column: int, reach: int) -> Patch:
    return slice(row - reach, row + reach + 1), slice(column - reach, column + reach + 1)


def _mean_of_subpixels(values: FloatArray) -> FloatArray:
    # summed by strides: NumPy's mean over two short axes takes four times as long, and this is done for every bead
    parts = [
        values[row::_SUBPIXELS, column::_SUBPIXELS] for row, column in np.ndindex(_SUBPIXELS, _SUBPIXELS)
    ]
    mean: FloatArray = np.add.reduce(parts) / _SUBPIXELS**2
    return mean


def _blur(image: FloatArray, width: float) -> FloatArray:
    return np.asarray(cv2.GaussianBlur(image, (0, 0), width), dtype=np.float64)


def _digitise(level: FloatArray, settings: SceneSettings, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Return the grey levels that the sensor reads for mean levels in DN, with shot and read noise."""
    noise = np.sqrt(level / settings.electrons_per_dn + settings.read_noise**2)
    return np.clip(np.rint(level + noise * rng.standard_normal(level.shape)), 0, 255).astype(np.uint8)


def _white(camera: PinholeCamera, settings: SceneSettings) -> FloatArray:
    """Return the level of full white in every pixel, DN."""
    x = np.linspace(-0.5, 0.5, camera.width)
    y = np.linspace(-0.5, 0.5, camera.height)[:, None]
    return (
        settings.white_level
        * (1.0 - settings.vignetting * 2.0 * (x * x + y * y))
        * (1.0 + settings.shading * x)
    )


def _surface_reflectance(camera: PinholeCamera, settings: SceneSettings) -> FloatArray:
    """Return the reflectance of the phantom's top, and of the table around it, as the camera sees them."""
    columns = np.arange(0, camera.width + _RAY_GRID, _RAY_GRID)
    rows = np.arange(0, camera.height + _RAY_GRID, _RAY_GRID)
    directions = camera.rays(np.stack(np.meshgrid(columns, rows), axis=-1))
    range_m = (settings.phantom_size[2] / 2 - camera.centre[2]) / directions[..., 2:]
    on_plane = (camera.centre + range_m * directions)[..., :2].astype(np.float32)
    in_grid = np.indices((camera.height, camera.width), dtype=np.float32)[::-1] / _RAY_GRID
    x, y = cv2.split(cv2.remap(on_plane, in_grid[0], in_grid[1], cv2.INTER_LINEAR))
    half_x, half_y = settings.phantom_size[0] / 2, settings.phantom_size[1] / 2
    texture = cv2.remap(
        _texture(settings).astype(np.float32),
        (x + np.float32(half_x)) / np.float32(_TEXTURE_PITCH_M),
        (y + np.float32(half_y)) / np.float32(_TEXTURE_PITCH_M),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REFLECT_101,
    )
    on_phantom = (np.abs(x) <= half_x) & (np.abs(y) <= half_y)
    reflectance: FloatArray = (
        np.where(on_phantom, settings.surface_reflectance, settings.table_reflectance) * texture
    )
    return reflectance


def _texture(settings: SceneSettings) -> FloatArray:
    """Return the relative reflectance of the surface, the same for every camera: fine and coarse grain."""
    columns, rows = (round(size / _TEXTURE_PITCH_M) for size in settings.phantom_size[:2])
    white = np.random.default_rng(_TEXTURE_SEED).standard_normal((rows, columns))
    fine, coarse = _blur(white, 1.5), _blur(white, 12.0)
    grain: FloatArray = (fine / fine.std() + coarse / coarse.std()) / np.sqrt(2.0)
    return 1.0 + settings.texture * grain


def _mosaic(colour: tuple[float, float, float], camera: PinholeCamera, settings: SceneSettings) -> FloatArray:
    """Return the response (height, width) of the sensor's filters to a colour; ones for a mono sensor."""
    response = np.ones((camera.height, camera.width))
    if settings.pixel_format == "bayer_rggb8":
        red, green, blue = colour
        response[0::2, 0::2] = red
        response[0::2, 1::2] = response[1::2, 0::2] = green
        response[1::2, 1::2] = blue
    return response
