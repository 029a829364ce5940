"""The beads in every measuring window: pairs of images, the beads in space, and their means over the window.

The beads are followed from the first window to the last, for a bead is told from its neighbours by where it was just
before; between the windows a few pairs are enough for that. Of the pairs in a window all are looked at, or where there
is no time for that some of them, which depend on their numbers alone.
"""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.errors import SynchronisationError
from daq.progress import Progress
from daq.rig import Rig
from daq.synchronisation.exposed_images import (
    ExposedImages,
    RecordedExposures,
    bead_tracker,
    exposed_images,
    measured_coordinates,
)
from daq.synchronisation.windows import Means, Window
from daq.timing.event_times import EventTimes
from robot_drivers.protocols import FloatArray, IntArray

_FOLLOW_NS = 400_000_000


@dataclass(frozen=True, slots=True)
class FiducialTrack:
    """The beads in some pairs of images.

    Attributes
    ----------
    time_ns : (p,) of the exposures, host clock
    positions : (p, m, 3) in the order of the rig's design, tissue frame, m; NaN where a bead was not seen, and for the
        heights that one camera does not measure
    rejected : what was seen in all pairs and not used, by stage and reason
    """

    time_ns: IntArray
    positions: FloatArray
    rejected: Mapping[str, int]


@dataclass(frozen=True, slots=True)
class FiducialMeans:
    """The beads in every window.

    Attributes
    ----------
    means : of their positions (n, m, 3), in the order of the rig's design, m
    times : of each camera's images, by the camera's role
    rejected : what was seen and not used, by stage and reason: unpaired images, and marks in the paired ones
    """

    means: Means
    times: dict[str, EventTimes]
    rejected: Mapping[str, int]


def fiducial_means(
    recording: RecordedExposures,
    rig: Rig,
    windows: Sequence[Window],
    progress: Progress,
    most_per_s: float = math.inf,
) -> FiducialMeans:
    """Return the means of the beads over the windows, of which about so many pairs a second are looked at, at most.

    One camera without a planar view measures no place: of such a rig there are no beads.

    Raises
    ------
    SynchronisationError
        A bead is not seen at rest, or the images are of another format than the rig file says.
    VisionError
        Too few beads are seen in the first images.
    """
    if not rig.measuring_cameras:
        return no_fiducials(windows)
    images = exposed_images(recording, rig)
    track = track_fiducials(images, rig, needed_pairs(images, windows, most_per_s), progress)
    return means_of_track(images, track, windows)


def no_fiducials(windows: Sequence[Window]) -> FiducialMeans:
    """Return what is known of the beads where nothing measures them."""
    none = np.empty((len(windows), 0, 3))
    return FiducialMeans(Means(none, none, (0,) * len(windows)), {}, {})


def means_of_track(images: ExposedImages, track: FiducialTrack, windows: Sequence[Window]) -> FiducialMeans:
    """Return the means over the windows of beads that were followed through the images.

    Raises
    ------
    SynchronisationError
        A bead is not seen at rest.
    """
    unpaired = {f"pairing: {role}, no partner in time": n for role, n in images.unpaired.items() if n}
    means = _means(track.positions, track.time_ns, windows)
    return FiducialMeans(means, images.times, {**unpaired, **track.rejected})


def track_fiducials(
    images: ExposedImages, rig: Rig, chosen: NDArray[np.bool_], progress: Progress
) -> FiducialTrack:
    """Follow the beads through the chosen pairs (p,), the first of which shows the phantom at rest.

    Raises
    ------
    VisionError
        Too few beads are seen in the first pair.
    """
    track = bead_tracker(rig)
    exposed_ns = images.exposed_ns[chosen]
    positions = np.empty((len(exposed_ns), len(rig.specimen.fiducials_m), 3))
    rejected: Counter[str] = Counter()
    for number, together in enumerate(images.decoded(chosen)):
        progress("finding the beads", number, len(exposed_ns))
        time_s = (exposed_ns[number] - exposed_ns[0]) * 1e-9
        observation = track(together, time_s)
        positions[number] = observation.positions
        rejected.update(observation.rejected)
    return FiducialTrack(exposed_ns, positions, rejected)


def needed_pairs(
    images: ExposedImages, windows: Sequence[Window], most_per_s: float = math.inf
) -> NDArray[np.bool_]:
    """Tell which pairs (p,) are in a window, about so many a second, or follow the last needed one after a while."""
    exposed_ns, left = images.exposed_ns, next(iter(images.times.values()))
    every = max(1, math.floor(1.0 / (most_per_s * left.period_s)))
    told = images.pairs[:, 0] % every == 0
    needed = np.zeros(len(exposed_ns), dtype=np.bool_)
    for window in windows:
        needed |= told & (exposed_ns >= window.begin_ns) & (exposed_ns <= window.end_ns)
    last_ns = windows[0].begin_ns
    for number, time_ns in enumerate(exposed_ns.tolist()):
        if windows[0].begin_ns <= time_ns <= windows[-1].end_ns:
            needed[number] |= time_ns - last_ns >= _FOLLOW_NS
            last_ns = time_ns if needed[number] else last_ns
    return needed


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
    at_rest = means[0][:, measured_coordinates(positions)]
    if not np.all(np.isfinite(at_rest)):
        unseen = np.flatnonzero(~np.isfinite(at_rest).all(axis=1)).tolist()
        raise SynchronisationError(
            f"fiducials {unseen} (from 0) are not seen at rest; uncover them and record again"
        )
    return Means(np.array(means), np.array(scatters), tuple(counts))
