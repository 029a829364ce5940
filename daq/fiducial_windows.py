"""The beads in every measuring window: pairs of images, their beads in space, and the means over the window."""

from collections.abc import Sequence

import numpy as np

from daq.progress import Progress
from daq.recording.folder import CALIBRATION_FOLDER
from daq.recording.reader import Images, Recording
from daq.rig import Rig
from daq.timing.event_times import EventTimes, estimate_event_times
from daq.windows import Means, Window
from robot_drivers.protocols import IntArray


def camera_times(images: Images) -> EventTimes:
    """Return when the images were exposed; by the receive stamps alone where the camera has no clock."""
    if np.all(np.isfinite(images.device_time_s)):
        return estimate_event_times(images.device_time_s, images.host_time_ns)
    return estimate_event_times(images.host_time_ns, images.host_time_ns)


def image_pairs(left: EventTimes, right: EventTimes) -> IntArray:
    """Return (p, 2) indices of left and right images that were exposed together, to half a period."""
    nearest = np.searchsorted(right.time_ns, left.time_ns)
    before = np.clip(nearest - 1, 0, len(right.time_ns) - 1)
    after = np.clip(nearest, 0, len(right.time_ns) - 1)
    apart_before = np.abs(right.time_ns[before] - left.time_ns)
    apart_after = np.abs(right.time_ns[after] - left.time_ns)
    partner = np.where(apart_before < apart_after, before, after)
    together = np.minimum(apart_before, apart_after) < 0.5e9 * left.period_s
    return np.stack([np.flatnonzero(together), partner[together]], axis=1)


def fiducial_means(
    recording: Recording, rig: Rig, windows: Sequence[Window], progress: Progress
) -> tuple[Means, dict[str, EventTimes]]:
    """Return the mean positions (n, m, 3) of the beads in the order of the rig's design, and the cameras' times.

    Raises
    ------
    SynchronisationError
        A bead is not seen at rest.
    """
    left, right = (recording.images(camera.name) for camera in rig.cameras)
    left_times, right_times = camera_times(left), camera_times(right)
    pairs = image_pairs(left_times, right_times)
    calibration = StereoCalibration.load(recording.folder / CALIBRATION_FOLDER / rig.stereo_calibration.name)
    tracker = FiducialTracker(calibration, np.array(rig.specimen.fiducials_m))
    found = []
    for number, window in enumerate(windows):
        progress("finding the beads", number, len(windows))
        exposed = left_times.time_ns[pairs[:, 0]]
        inside = pairs[(exposed >= window.begin_ns) & (exposed <= window.end_ns)]
        found.append([tracker.track(left.image(i), right.image(j)) for i, j in inside])
    return _means(found), {
        f"camera {rig.cameras[0].name}": left_times,
        f"camera {rig.cameras[1].name}": right_times,
    }
