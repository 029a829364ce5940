"""Beads in space by one depth camera: the ray through a bead's image, as far as the depth at the bead says.

Image and depth are of the same pixels. What is measured is the visible surface at the bead: of a disc on the skin that
is its middle, of a ball the point that faces the camera. A depth that is off moves a bead along its ray, so that its
deviation is large along the optical axis and small across it.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from daq.vision.beads import detect_beads
from daq.vision.camera_model import PinholeCamera
from daq.vision.fiducials import FiducialObservation, FiducialSettings
from daq.vision.identity import IdentityTracker

FloatArray = NDArray[np.float64]

# Of the middle half of normal values: its standard deviation as a share of that of all, and that of its mean as a
# multiple of that of the mean of all.
_MIDDLE_STD, _MIDDLE_MEAN_STD = 0.378, 1.09


@dataclass(frozen=True, slots=True)
class DepthView:
    """One depth camera that looks at the beads.

    Attributes
    ----------
    calibration : file of the camera in the tissue frame, by ``retract calibrate camera``
    depth_std_m : by how much the depth at a bead may be off in all images of a measuring window alike, as a standard
        deviation, m: what no averaging takes away. What averages out is measured
    at_range_m : depth at which that holds, m; it grows with the square of the depth
    least_pixels : with known depth, without which a bead counts as not seen
    """

    calibration: Path
    depth_std_m: float
    at_range_m: float
    least_pixels: int = 9

    def __post_init__(self) -> None:
        if not self.depth_std_m >= 0:
            raise ValueError(f"depth_std_m must not be negative, as {self.depth_std_m!r} is")
        if not self.at_range_m > 0:
            raise ValueError(f"at_range_m must be positive, not {self.at_range_m!r}")
        if self.least_pixels < 1:
            raise ValueError(f"least_pixels must be 1 or more, not {self.least_pixels}")

    def camera(self) -> PinholeCamera:
        """Read the calibration; raises RigError where the file is none."""
        return PinholeCamera.load(self.calibration)

    def deviation_m(self, depth: FloatArray) -> FloatArray:
        """Return by how much depths (n,), m, may be off alike in many images."""
        deviation: FloatArray = self.depth_std_m * (depth / self.at_range_m) ** 2
        return deviation

    def noise_by_axis(self, rest: ArrayLike, scatter: ArrayLike) -> dict[str, float]:
        """Return the noise of x, y and z, m, of beads at rest positions (n, 3) whose means scatter by ``scatter``.

        Parameters
        ----------
        scatter : of all axes, or of each (3,), m

        Raises
        ------
        RigError
            The calibration cannot be read.
        """
        camera, points = self.camera(), np.asarray(rest, dtype=np.float64).reshape(-1, 3)
        along = self.deviation_m(camera.to_camera(points)[:, 2])[:, None] * per_depth(camera, points)
        by_axis = np.hypot(scatter, np.sqrt(np.mean(along**2, axis=0)))
        return dict(zip("xyz", by_axis.tolist(), strict=True))


@dataclass(frozen=True, slots=True)
class BeadDepths:
    """Depth at the beads of one image.

    Attributes
    ----------
    depth : (n,) along the optical axis, m; NaN where too few pixels know theirs
    std : (n,) standard deviation by the scatter of the pixels of a bead, m
    """

    depth: FloatArray
    std: FloatArray


def depths_at(depth: FloatArray, centres: FloatArray, radii: FloatArray, least_pixels: int) -> BeadDepths:
    """Return the depth of discs of ``radii`` (n,) about ``centres`` (n, 2), px, in a depth image (height, width), m.

    It is the mean of the middle half of the values: as little moved by some that are far off as their median, and
    finer than the steps in which a camera counts.
    """
    height, width = depth.shape
    found, deviations = np.full(len(centres), np.nan), np.full(len(centres), np.nan)
    for number, ((column, row), radius) in enumerate(zip(centres, radii, strict=True)):
        rows = np.arange(max(0, int(row - radius)), min(height, int(row + radius) + 2))
        columns = np.arange(max(0, int(column - radius)), min(width, int(column + radius) + 2))
        inside = np.hypot(rows[:, None] - row, columns - column) <= radius
        values = depth[np.ix_(rows, columns)][inside]
        values = np.sort(values[np.isfinite(values)])
        if len(values) >= least_pixels:
            middle = values[len(values) // 4 : len(values) - len(values) // 4]
            found[number] = middle.mean()
            deviations[number] = _MIDDLE_MEAN_STD * middle.std() / _MIDDLE_STD / np.sqrt(len(values))
    return BeadDepths(found, deviations)


def at_depth(camera: PinholeCamera, pixels: FloatArray, depth: FloatArray) -> FloatArray:
    """Return the points (n, 3), tissue frame, m, that are seen at pixels (n, 2) in depths (n,), m."""
    rays = camera.rays(pixels)
    along_axis = rays @ camera.R_cam_tissue[2]
    points: FloatArray = camera.centre + rays * (depth / along_axis)[:, None]
    return points


def per_depth(camera: PinholeCamera, points: FloatArray) -> FloatArray:
    """Return by how much points (n, 3), m, move for each unit of the depth at which they are seen, (n, 3)."""
    from_camera = points - camera.centre
    moved: FloatArray = from_camera / (from_camera @ camera.R_cam_tissue[2])[:, None]
    return moved


class DepthTracker:
    """Measures the beads in consecutive images; the first one shows the phantom at rest.

    Parameters
    ----------
    view : of the camera
    rest : (n, 3) the design's rest positions of the beads, tissue frame, m
    settings : of bead detection and identity; of stereo only the box in which beads can be
    """

    def __init__(self, view: DepthView, rest: ArrayLike, settings: FiducialSettings) -> None:
        self._view, self._camera = view, view.camera()
        self._settings = settings
        self._identity = IdentityTracker(rest, settings.identity)

    def update(self, image: NDArray[np.uint8], depth: FloatArray, time_s: float) -> FiducialObservation:
        """Measure a raw image and its depth in m, both (height, width), that were exposed at ``time_s``.

        Raises
        ------
        VisionError
            The first image lacks more fiducials than may be hidden, or the images are not in order of time.
        """
        seen = detect_beads(image, self._settings.beads)
        found = depths_at(depth, seen.centres, seen.radii, self._view.least_pixels)
        known = np.isfinite(found.depth)
        places = at_depth(self._camera, seen.centres, found.depth)
        box = self._settings.stereo
        inside = known & np.all((places >= box.lower) & (places <= box.upper), axis=1)
        points = places[inside]
        spread = self._covariances(points, seen.covariances[inside], found.depth[inside], found.std[inside])
        assignment = self._identity.assign(points, time_s)
        named = assignment.points >= 0
        positions, covariances = np.full((len(named), 3), np.nan), np.full((len(named), 3, 3), np.nan)
        positions[named] = points[assignment.points[named]]
        covariances[named] = spread[assignment.points[named]]
        rejected = {f"image: {why}": n for why, n in seen.rejected.items()}
        rejected |= {f"identity: {why}": n for why, n in assignment.rejected.items()}
        for why, left_out in (("no depth", ~known), ("outside the box", known & ~inside)):
            if left_out.any():
                rejected[f"depth: {why}"] = int(left_out.sum())
        return FiducialObservation(time_s, positions, covariances, rejected)

    def _covariances(
        self, points: FloatArray, spread_px: FloatArray, depth: FloatArray, std: FloatArray
    ) -> FloatArray:
        """Return the covariances (n, 3, 3), m², of points whose images spread by ``spread_px`` (n, 2, 2), px²."""
        across = self._camera.R_cam_tissue[:2]
        _, jacobian = self._camera.project_with_jacobian(points)
        by_pixel = across.T @ np.linalg.inv(jacobian @ across.T)
        along = np.hypot(std, self._view.deviation_m(depth))[:, None] * per_depth(self._camera, points)
        carried: FloatArray = by_pixel @ spread_px @ by_pixel.transpose(0, 2, 1)
        return carried + along[:, :, None] * along[:, None, :]
