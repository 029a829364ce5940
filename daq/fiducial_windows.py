"""The beads in every measuring window: pairs of images, the beads in space, and their means over the window.

The beads are followed from the first window to the last, for a bead is told from its neighbours by where it was just
before; between the windows a few pairs are enough for that.
"""

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from daq.errors import SynchronisationError
from daq.progress import Progress
from daq.recording.reader import Images, Recording
from daq.rig import Rig
from daq.timing.event_times import EventTimes, estimate_event_times
from daq.vision.camera_model import StereoCalibration
from daq.vision.fiducials import FiducialTracker
from daq.windows import Means, Window
from robot_drivers.protocols import FloatArray, IntArray

_DECODED_AHEAD = 4
_FOLLOW_NS = 400_000_000

ImagePair = tuple[NDArray[np.uint8], NDArray[np.uint8]]


def fiducial_means(
    recording: Recording, rig: Rig, windows: Sequence[Window], progress: Progress
) -> tuple[Means, dict[str, EventTimes]]:
    """Return the mean positions (n, m, 3) of the beads in the order of the rig's design, and the cameras' times.

    Raises
    ------
    SynchronisationError
        A bead is not seen at rest, or the images are of another format than the rig file says.
    VisionError
        Too few beads are seen in the first images.
    """
    roles = [f"camera {camera.name}" for camera in rig.cameras]
    left, right = (recording.images(camera.name) for camera in rig.cameras)
    for role, images in zip(roles, (left, right), strict=True):
        _check_format(role, images, rig.vision.beads.pixel_format)
    left_times, right_times = _exposure_times(left), _exposure_times(right)
    pairs = _pairs(left_times, right_times)
    exposed_ns = left_times.time_ns[pairs[:, 0]]
    used = _needed(exposed_ns, windows)
    pairs, exposed_ns = pairs[used], exposed_ns[used]

    tracker = FiducialTracker(
        StereoCalibration.load(rig.stereo_calibration), rig.specimen.fiducials_m, rig.vision
    )
    positions = np.empty((len(pairs), len(rig.specimen.fiducials_m), 3))
    for number, (left_image, right_image) in enumerate(_decoded(left, right, pairs)):
        progress("finding the beads", number, len(pairs))
        time_s = (exposed_ns[number] - exposed_ns[0]) * 1e-9
        positions[number] = tracker.update(left_image, right_image, time_s).positions
    return _means(positions, exposed_ns, windows), dict(zip(roles, (left_times, right_times), strict=True))


def _check_format(role: str, images: Images, pixel_format: str) -> None:
    if len(images) == 0:
        raise SynchronisationError(f"{role}: recorded no image; record the retraction again")
    if images.pixel_format(0) != pixel_format:
        raise SynchronisationError(
            f"{role}: recorded {images.pixel_format(0)} images, vision.beads.pixel_format of the rig file says "
            f"{pixel_format}; make them agree"
        )


def _exposure_times(images: Images) -> EventTimes:
    """Return when the images were exposed; by the receive stamps alone where the camera has no clock."""
    has_clock = bool(np.all(np.isfinite(images.device_time_s)))
    return estimate_event_times(
        images.device_time_s if has_clock else images.host_time_ns, images.host_time_ns
    )


def _pairs(left: EventTimes, right: EventTimes) -> IntArray:
    """Return (p, 2) indices of left and right images that were exposed together, to half a period."""
    after = np.clip(np.searchsorted(right.time_ns, left.time_ns), 0, len(right.time_ns) - 1)
    before = np.clip(after - 1, 0, None)
    nearer_before = left.time_ns - right.time_ns[before] < right.time_ns[after] - left.time_ns
    partner = np.where(nearer_before, before, after)
    together = np.abs(right.time_ns[partner] - left.time_ns) < 0.5e9 * left.period_s
    return np.stack([np.flatnonzero(together), partner[together]], axis=1)


def _needed(exposed_ns: IntArray, windows: Sequence[Window]) -> NDArray[np.bool_]:
    """Tell which pairs (p,) are in a window, or follow the last needed one after a while."""
    needed = np.zeros(len(exposed_ns), dtype=np.bool_)
    for window in windows:
        needed |= (exposed_ns >= window.begin_ns) & (exposed_ns <= window.end_ns)
    last_ns = windows[0].begin_ns
    for number, time_ns in enumerate(exposed_ns.tolist()):
        if windows[0].begin_ns <= time_ns <= windows[-1].end_ns:
            needed[number] |= time_ns - last_ns >= _FOLLOW_NS
            last_ns = time_ns if needed[number] else last_ns
    return needed


def _decoded(left: Images, right: Images, pairs: IntArray) -> Iterator[ImagePair]:
    """Decode pairs in order, a few of them ahead in threads."""
    with ThreadPoolExecutor(_DECODED_AHEAD) as pool:
        waiting = [
            (pool.submit(left.image, i), pool.submit(right.image, j))
            for i, j in pairs[:_DECODED_AHEAD].tolist()
        ]
        for number in range(len(pairs)):
            left_image, right_image = waiting.pop(0)
            for i, j in pairs[number + _DECODED_AHEAD : number + _DECODED_AHEAD + 1].tolist():
                waiting.append((pool.submit(left.image, i), pool.submit(right.image, j)))
            yield left_image.result(), right_image.result()


def _means(positions: FloatArray, exposed_ns: IntArray, windows: Sequence[Window]) -> Means:
    """Average over the windows, every bead by itself; the noise of images is independent."""
    means, scatters, counts = [], [], []
    for window in windows:
        inside = positions[(exposed_ns >= window.begin_ns) & (exposed_ns <= window.end_ns)]
        seen = np.isfinite(inside).sum(axis=0)
        total = np.nansum(inside, axis=0)
        mean = np.divide(total, seen, where=seen > 0, out=np.full(total.shape, np.nan))
        squares = np.nansum((inside - mean) ** 2, axis=0)
        freedom = seen * (seen - 1)
        variance = np.divide(squares, freedom, where=freedom > 0, out=np.full(total.shape, np.nan))
        means.append(mean)
        scatters.append(np.sqrt(variance))
        counts.append(len(inside))
    if not np.all(np.isfinite(means[0])):
        unseen = np.flatnonzero(~np.isfinite(means[0]).all(axis=1)).tolist()
        raise SynchronisationError(
            f"fiducials {unseen} (from 0) are not seen at rest; uncover them and record again"
        )
    return Means(np.array(means), np.array(scatters), tuple(counts))
