"""The fiducials' positions from pairs of images: beads, stereo, identity, in this order."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from daq.vision.beads import BeadSettings, detect_beads
from daq.vision.camera_model import StereoCalibration
from daq.vision.errors import VisionError
from daq.vision.identity import IdentitySettings, IdentityTracker
from daq.vision.stereo import StereoSettings, match

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class FiducialSettings:
    """Settings of the three stages."""

    beads: BeadSettings = field(default_factory=BeadSettings)
    stereo: StereoSettings = field(default_factory=StereoSettings)
    identity: IdentitySettings = field(default_factory=IdentitySettings)


@dataclass(frozen=True, slots=True)
class FiducialObservation:
    """What one pair of images tells.

    Attributes
    ----------
    time_s : of the exposure
    positions : (n, 3) tissue frame, m; NaN where a fiducial was not seen
    covariances : (n, 3, 3) m², of the image noise; NaN where a fiducial was not seen
    rejected : what was seen and not used, by stage and reason
    """

    time_s: float
    positions: FloatArray
    covariances: FloatArray
    rejected: Mapping[str, int]


class FiducialTracker:
    """Measures the fiducials in consecutive pairs of images; the first pair shows the phantom at rest.

    Parameters
    ----------
    calibration : of the two cameras, in the tissue frame
    rest : (n, 3) the design's rest positions of the fiducials, tissue frame, m
    settings : of bead detection, stereo and identity
    """

    def __init__(self, calibration: StereoCalibration, rest: ArrayLike, settings: FiducialSettings) -> None:
        self._calibration = calibration
        self._settings = settings
        self._identity = IdentityTracker(rest, settings.identity)

    def update(
        self, left_image: NDArray[np.uint8], right_image: NDArray[np.uint8], time_s: float
    ) -> FiducialObservation:
        """Measure one pair of raw images (height, width) that were exposed together at ``time_s``.

        Raises
        ------
        VisionError
            The first pair lacks more fiducials than may be hidden, or the pairs are not in order of time.
        """
        left = detect_beads(left_image, self._settings.beads)
        right = detect_beads(right_image, self._settings.beads)
        matches = match(self._calibration, left, right, self._settings.stereo)
        assignment = self._identity.assign(matches.points.positions, time_s)
        seen = assignment.points >= 0
        positions = np.full((len(seen), 3), np.nan)
        covariances = np.full((len(seen), 3, 3), np.nan)
        positions[seen] = matches.points.positions[assignment.points[seen]]
        covariances[seen] = matches.points.covariances[assignment.points[seen]]
        stages = {
            "left": left.rejected,
            "right": right.rejected,
            "stereo": matches.rejected,
            "identity": assignment.rejected,
        }
        rejected = {f"{stage}: {why}": n for stage, counts in stages.items() for why, n in counts.items()}
        return FiducialObservation(time_s, positions, covariances, rejected)


def average_rest(observations: Sequence[FiducialObservation], tolerance_m: float = 1e-4) -> FloatArray:
    """Return each fiducial's own rest position (n, 3), m: the mean over pairs of images of the phantom at rest.

    Raises
    ------
    VisionError
        There are no images, a fiducial is in none of them, or one strays from its mean by more than
        ``tolerance_m``.
    """
    if not observations:
        raise VisionError("rest positions: no images were given; take some before the first motion")
    positions = np.array([observation.positions for observation in observations])
    unseen = np.flatnonzero(np.isnan(positions).any(axis=2).all(axis=0))
    if len(unseen):
        raise VisionError(
            f"rest positions: fiducials {', '.join(map(str, unseen))} are in none of {len(positions)} pairs of images; "
            "uncover them, or give the design's positions"
        )
    mean: FloatArray = np.nanmean(positions, axis=0)
    strays = np.nanmax(np.linalg.norm(positions - mean, axis=2), axis=0)
    if strays.max() > tolerance_m:
        raise VisionError(
            f"rest positions: fiducial {strays.argmax()} moves by {1e6 * strays.max():.0f} µm between images that "
            "should show it at rest; take images before the first motion"
        )
    return mean
