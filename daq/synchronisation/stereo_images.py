"""The images of a recording in pairs that were exposed together."""

from collections.abc import Iterator
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from daq.errors import SynchronisationError
from daq.recording.stored_streams import Images
from daq.rig import Rig
from daq.synchronisation.decoding import Together, decoded_ahead
from daq.synchronisation.stream_times import exposure_times
from daq.timing.pairing import pair_by_time
from robot_drivers.protocols import IntArray

_LARGEST_DIFFERENCE = 0.5  # periods between the exposures of a pair


class RecordedImages(Protocol):
    """A recording, sealed or still running, as far as its images go."""

    def images(self, camera: str) -> Images:
        """Return the images of one camera; raises RecordingError for an unknown one."""


class StereoImages:
    """Pairs of images of a rig's stereo pair, by the times of their exposure.

    Attributes
    ----------
    pairs : (p, 2) numbers of the left and the right image of each pair, in order of time
    times : exposure times of each camera's images, by the camera's role; the rig's latency is taken off
    unpaired : images of each camera that have no partner, by the camera's role
    exposed_ns : (p,) of each pair, host clock

    Raises
    ------
    SynchronisationError
        A camera recorded no image, or images of another format than the rig file says.
    RigError
        The rig has one camera.
    """

    def __init__(self, recording: RecordedImages, rig: Rig) -> None:
        roles = [f"camera {camera.name}" for camera in rig.pair]
        self._left, self._right = (recording.images(camera.name) for camera in rig.pair)
        for role, images in zip(roles, (self._left, self._right), strict=True):
            check_format(role, images, rig.vision.beads.pixel_format)
        left, right = (exposure_times(images, rig) for images in (self._left, self._right))
        self.times = dict(zip(roles, (left, right), strict=True))
        pairing = pair_by_time(left.time_ns, right.time_ns, _LARGEST_DIFFERENCE * left.period_s * 1e9)
        self.unpaired = dict(zip(roles, (pairing.unpaired_left, pairing.unpaired_right), strict=True))
        self.pairs: IntArray = pairing.index
        self.exposed_ns: IntArray = left.time_ns[self.pairs[:, 0]]

    def decoded(self, chosen: NDArray[np.bool_]) -> Iterator[Together]:
        """Decode the chosen pairs (p,) in order, a few of them ahead in threads."""
        return decoded_ahead(
            [
                (partial(self._left.image, left), partial(self._right.image, right))
                for left, right in self.pairs[chosen].tolist()
            ]
        )


def check_format(role: str, images: Images, pixel_format: str) -> None:
    """Refuse images of another format than the rig file says; raises SynchronisationError."""
    if len(images) == 0:
        raise SynchronisationError(f"{role}: recorded no image; record the retraction again")
    if images.pixel_format(0) != pixel_format:
        raise SynchronisationError(
            f"{role}: recorded {images.pixel_format(0)} images, vision.beads.pixel_format of the rig file says "
            f"{pixel_format}; make them agree"
        )
