"""Beads of one flat face, measured by one calibrated camera: where their rays meet the height at which they rest.

One camera tells no depth. A bead that leaves its height by dz is seen beside its place by the slope of its ray times
dz; so height is not measured, and an uncertainty of the height belongs into that of the other two coordinates.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from daq.vision.beads import detect_beads
from daq.vision.camera_model import PinholeCamera
from daq.vision.errors import VisionError
from daq.vision.fiducials import FiducialObservation, FiducialSettings
from daq.vision.identity import IdentityTracker

FloatArray = NDArray[np.float64]

MOST_HEIGHTS_APART_M = 1e-3
_STEEPEST = 2.0  # slope of a ray beyond which its meeting with the face says little


def at_height(camera: PinholeCamera, pixels: FloatArray, height_m: ArrayLike) -> FloatArray:
    """Return where the rays through pixels (n, 2) meet a height (n,) or one for all, tissue frame, (n, 3), m.

    NaN where a ray runs along the face, or away from it.
    """
    rays = camera.rays(pixels)
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = (np.asarray(height_m) - camera.centre[2]) / rays[:, 2]
        slopes = np.hypot(rays[:, 0], rays[:, 1]) / np.abs(rays[:, 2])
    reach = np.where((reach > 0) & (slopes < _STEEPEST), reach, np.nan)
    return camera.centre + reach[:, None] * rays


def height_slopes(camera: PinholeCamera, points: ArrayLike) -> FloatArray:
    """Return by how much the seen x and y of points (n, 3), m, move for each unit of their height, (n, 2)."""
    rays = np.asarray(points, dtype=np.float64) - camera.centre
    slopes: FloatArray = -rays[:, :2] / rays[:, 2:]
    return slopes


def face_height_m(rest: ArrayLike) -> float:
    """Return the height of the face on which beads rest (n, 3), tissue frame, m.

    Raises
    ------
    VisionError
        They rest at several heights.
    """
    heights = np.asarray(rest, dtype=np.float64).reshape(-1, 3)[:, 2]
    apart_m = float(np.ptp(heights)) if len(heights) else 0.0
    if apart_m > MOST_HEIGHTS_APART_M:
        raise VisionError(
            f"one camera measures beads of one flat face, and those of the design rest at heights that differ by "
            f"{1e3 * apart_m:.1f} mm; leave out those of other faces, or use two cameras"
        )
    return float(np.mean(heights)) if len(heights) else 0.0


@dataclass(frozen=True, slots=True)
class PlanarView:
    """One camera that looks at the beads of one flat face.

    Attributes
    ----------
    calibration : file of the camera in the tissue frame, by ``retract calibrate camera``
    height_std_m : how far beads may leave the height at which they rest, as a standard deviation, m. It goes into their
        uncertainty by the slope at which the camera sees them
    """

    calibration: Path
    height_std_m: float

    def __post_init__(self) -> None:
        if not self.height_std_m >= 0:
            raise ValueError(f"height_std_m must not be negative, as {self.height_std_m!r} is")

    def camera(self) -> PinholeCamera:
        """Read the calibration; raises RigError where the file is none."""
        return PinholeCamera.load(self.calibration)

    def noise_by_axis(self, rest: ArrayLike, image_std: float) -> dict[str, float]:
        """Return the noise of x and of y, m, of beads at rest positions (n, 3) whose images alone give ``image_std``.

        Raises
        ------
        RigError
            The calibration cannot be read.
        """
        slopes = height_slopes(self.camera(), np.asarray(rest, dtype=np.float64).reshape(-1, 3))
        by_height = self.height_std_m * np.sqrt(np.mean(slopes**2, axis=0))
        x, y = np.hypot(image_std, by_height).tolist()
        return {"x": x, "y": y}


class PlanarTracker:
    """Measures the beads of one face in consecutive images; the first image shows the phantom at rest.

    Parameters
    ----------
    camera : calibrated, in the tissue frame
    rest : (n, 3) the design's rest positions of the beads, tissue frame, m; all at one height
    settings : of bead detection and identity; of stereo only the box in which beads can be

    Raises
    ------
    VisionError
        The beads rest at several heights.
    """

    def __init__(self, camera: PinholeCamera, rest: ArrayLike, settings: FiducialSettings) -> None:
        self._camera = camera
        self._settings = settings
        self._rest = np.asarray(rest, dtype=np.float64).reshape(-1, 3)
        self._height_m = face_height_m(self._rest)
        self._identity = IdentityTracker(self._rest, settings.identity)

    def update(self, image: NDArray[np.uint8], time_s: float) -> FiducialObservation:
        """Measure one raw image (height, width) that was exposed at ``time_s``; heights are NaN.

        Raises
        ------
        VisionError
            The first image lacks more fiducials than may be hidden, or the images are not in order of time.
        """
        seen = detect_beads(image, self._settings.beads)
        face = at_height(self._camera, seen.centres, self._height_m)
        box = self._settings.stereo
        inside = np.all((face[:, :2] >= box.lower[:2]) & (face[:, :2] <= box.upper[:2]), axis=1)
        centres, spread = seen.centres[inside], seen.covariances[inside]
        assignment = self._identity.assign(face[inside], time_s)
        named = assignment.points >= 0
        rows = assignment.points[named]
        positions = np.full((len(named), 3), np.nan)
        covariances = np.full((len(named), 3, 3), np.nan)
        places = at_height(self._camera, centres[rows], self._rest[named, 2])
        positions[named, :2] = places[:, :2]
        covariances[named, :2, :2] = self._on_face(places, spread[rows])
        rejected = {f"image: {why}": n for why, n in seen.rejected.items()}
        rejected |= {f"identity: {why}": n for why, n in assignment.rejected.items()}
        if not inside.all():
            rejected["image: outside the box"] = int(np.sum(~inside))
        return FiducialObservation(time_s, positions, covariances, rejected)

    def _on_face(self, places: FloatArray, spread: FloatArray) -> FloatArray:
        """Carry covariances of pixels (n, 2, 2), px², to the face, (n, 2, 2), m²."""
        _, jacobian = self._camera.project_with_jacobian(places)
        by_pixel = np.linalg.inv(jacobian[:, :, :2])
        carried: FloatArray = by_pixel @ spread @ by_pixel.transpose(0, 2, 1)
        return carried
