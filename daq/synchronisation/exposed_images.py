"""The images that a rig measures beads in: those of its stereo pair, or of its only camera, with or without depth."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from daq.errors import SynchronisationError
from daq.recording.recorded_depth import DepthStreams, RecordedDepth
from daq.rig import Rig
from daq.synchronisation.decoding import Together, decoded_ahead
from daq.synchronisation.stereo_images import RecordedImages, StereoImages, check_format
from daq.synchronisation.stream_times import exposure_times
from daq.timing.event_times import EventTimes
from daq.vision.depth import DepthTracker
from daq.vision.fiducials import FiducialObservation, FiducialTracker
from daq.vision.planar import PlanarTracker
from robot_drivers.protocols import IntArray

Track = Callable[[Together, float], FiducialObservation]
"""Measures the beads in images that were exposed together at a time, s."""


class RecordedExposures(RecordedImages, DepthStreams, Protocol):
    """A recording, sealed or still running, as far as its images and their depth go."""


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
        return decoded_ahead(
            [(partial(self._images.image, number),) for (number,) in self.pairs[chosen].tolist()]
        )


class DepthImages:
    """Images of a rig's only camera with their depth in m; ``pairs`` (p, 2) are their numbers.

    An image and a depth are of one frame where they were received at the same instant.

    Raises
    ------
    SynchronisationError
        It recorded no image, no depth, or images of another format than the rig file says.
    RecordingError
        What depth is counted in changed meanwhile.
    """

    def __init__(self, recording: RecordedExposures, rig: Rig) -> None:
        (camera,) = rig.measuring_cameras
        role = f"camera {camera.name}"
        self._images = recording.images(camera.name)
        check_format(role, self._images, rig.vision.beads.pixel_format)
        self._depth = RecordedDepth.of(recording, camera.name)
        exposed = exposure_times(self._images, rig)
        stamps = self._images.host_time_ns
        _, of_images, of_depth = np.intersect1d(stamps, self._depth.images.host_time_ns, return_indices=True)
        if not len(of_images):
            raise SynchronisationError(f"{role}: recorded no depth; record the retraction again")
        self.times = {role: exposed}
        self.unpaired = {f"{role}, depth": len(stamps) - len(of_images)}
        self.exposed_ns: IntArray = exposed.time_ns[of_images]
        self.pairs: IntArray = np.column_stack([of_images, of_depth])

    def decoded(self, chosen: NDArray[np.bool_]) -> Iterator[Together]:
        """Decode the chosen images (p,) and their depth in order, a few of them ahead in threads."""
        return decoded_ahead(
            [
                (partial(self._images.image, number), partial(self._depth.metres, depth))
                for number, depth in self.pairs[chosen].tolist()
            ]
        )


def exposed_images(recording: RecordedExposures, rig: Rig) -> ExposedImages:
    """Return the images that a rig measures beads in.

    Raises
    ------
    SynchronisationError
        A camera recorded no image, or images of another format than the rig file says.
    RigError
        The rig has one camera, and measures no beads.
    """
    if rig.depth_view is not None:
        return DepthImages(recording, rig)
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
    if rig.depth_view is not None:
        depth = DepthTracker(rig.depth_view, rig.specimen.fiducials_m, rig.vision)
        return lambda images, time_s: depth.update(images[0], images[1], time_s)
    stereo = FiducialTracker(rig.stereo(), rig.specimen.fiducials_m, rig.vision)
    return lambda images, time_s: stereo.update(images[0], images[1], time_s)


def measured_coordinates(positions: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell which coordinates (3,) of beads (..., 3) anything measured."""
    measured = np.logical_or.reduce(np.isfinite(positions.reshape(-1, 3)), axis=0)
    return measured if np.any(measured) else ~measured
