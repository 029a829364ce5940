"""The images that a rig measures beads in: those of its stereo pair, or of its only camera."""

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from daq.rig import Rig
from daq.synchronisation.stereo_images import RecordedImages, StereoImages, check_format
from daq.synchronisation.stream_times import exposure_times
from daq.timing.event_times import EventTimes
from daq.vision.fiducials import FiducialObservation, FiducialTracker
from daq.vision.planar import PlanarTracker
from robot_drivers.protocols import IntArray

_DECODED_AHEAD = 4

Together = tuple[NDArray[np.uint8], ...]
"""Images that were exposed together, one of each camera."""

Track = Callable[[Together, float], FiducialObservation]
"""Measures the beads in images that were exposed together at a time, s."""


class ExposedImages(Protocol):
    """Images of a recording by the times of their exposure; see :class:`StereoImages` for their meaning."""

    times: dict[str, EventTimes]
    unpaired: dict[str, int]
    pairs: IntArray
    exposed_ns: IntArray

    def decoded(self, chosen: NDArray[np.bool_]) -> Iterator[Together]:
        """Decode the chosen ones (p,) in order."""


class SingleImages:
    """Images of a rig's only camera; ``pairs`` (p, 1) are their numbers.

    Raises
    ------
    SynchronisationError
        It recorded no image, or images of another format than the rig file says.
    """

    def __init__(self, recording: RecordedImages, rig: Rig) -> None:
        (camera,) = rig.measuring_cameras
        role = f"camera {camera.name}"
        self._images = recording.images(camera.name)
        check_format(role, self._images, rig.vision.beads.pixel_format)
        exposed = exposure_times(self._images, rig)
        self.times = {role: exposed}
        self.unpaired: dict[str, int] = {}
        self.exposed_ns: IntArray = exposed.time_ns
        self.pairs: IntArray = np.arange(len(exposed.time_ns), dtype=np.int64)[:, None]

    def decoded(self, chosen: NDArray[np.bool_]) -> Iterator[Together]:
        """Decode the chosen images (p,) in order, a few of them ahead in threads."""
        numbers = self.pairs[chosen, 0].tolist()
        with ThreadPoolExecutor(_DECODED_AHEAD) as pool:
            waiting = deque(pool.submit(self._images.image, number) for number in numbers[:_DECODED_AHEAD])
            for place in range(len(numbers)):
                image = waiting.popleft()
                for number in numbers[place + _DECODED_AHEAD : place + _DECODED_AHEAD + 1]:
                    waiting.append(pool.submit(self._images.image, number))
                yield (image.result(),)


def exposed_images(recording: RecordedImages, rig: Rig) -> ExposedImages:
    """Return the images that a rig measures beads in.

    Raises
    ------
    SynchronisationError
        A camera recorded no image, or images of another format than the rig file says.
    RigError
        The rig has one camera, and measures no beads.
    """
    return SingleImages(recording, rig) if rig.planar_view is not None else StereoImages(recording, rig)


def bead_tracker(rig: Rig) -> Track:
    """Return what measures the beads of a rig in consecutive images, the first of which show the phantom at rest.

    Raises
    ------
    RigError
        The rig measures no beads, or a calibration cannot be read.
    VisionError
        One camera is to measure beads at several heights.
    """
    if rig.planar_view is not None:
        planar = PlanarTracker(rig.planar_view.camera(), rig.specimen.fiducials_m, rig.vision)
        return lambda images, time_s: planar.update(images[0], time_s)
    stereo = FiducialTracker(rig.stereo(), rig.specimen.fiducials_m, rig.vision)
    return lambda images, time_s: stereo.update(images[0], images[1], time_s)


def measured_coordinates(positions: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell which coordinates (3,) of beads (..., 3) anything measured."""
    measured = np.logical_or.reduce(np.isfinite(positions.reshape(-1, 3)), axis=0)
    return measured if np.any(measured) else ~measured
