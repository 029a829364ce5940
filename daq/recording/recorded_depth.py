"""The depth images of a camera in a recording, with what their counts mean."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol, Self

from daq.errors import RecordingError
from daq.recording.events import DEPTH_SCALE
from daq.recording.stored_streams import Event, Images
from robot_drivers.cameras.depth import depth_m
from robot_drivers.protocols import DepthImage, DepthScale, FloatArray


class DepthStreams(Protocol):
    """A recording, sealed or still running, as far as its depth goes."""

    @property
    def events(self) -> Sequence[Event]:
        """In the order of their recording."""

    def depth(self, camera: str) -> Images:
        """Return the images of depth of one camera."""


@dataclass(frozen=True)
class RecordedDepth:
    """Depth images of one camera, and their scale; None where it was not recorded."""

    images: Images
    scale: DepthScale | None

    @classmethod
    def of(cls, recording: DepthStreams, camera: str) -> Self:
        """Find the depth of a camera.

        Raises
        ------
        RecordingError
            What the counts mean has changed while it was recorded, or is told in other words than a recorder's.
        """
        told = [event.details for event in recording.events if event.name == DEPTH_SCALE]
        scales = {_scale(one) for one in told if one.get("camera") == camera}
        if len(scales) > 1:
            raise RecordingError(
                f"the depth of camera {camera!r} was counted in {len(scales)} scales; record again and leave the "
                "settings of the camera alone meanwhile"
            )
        return cls(recording.depth(camera), next(iter(scales), None))

    def metres(self, number: int) -> FloatArray:
        """Return one image of depth along the optical axis (height, width), m; NaN where it is not known.

        Raises
        ------
        RecordingError
            It is damaged, or what its counts mean was not recorded.
        """
        if self.scale is None:
            raise RecordingError(f"depth image {number}: the recording does not tell what its counts mean")
        return depth_m(self.images.depth(number), self.scale)

    def received_at(self, host_time_ns: int) -> DepthImage | None:
        """Return the depth of the frame that was received then; None where it has none."""
        number = self._numbers.get(host_time_ns)
        if number is None or self.scale is None:
            return None
        return DepthImage(self.images.depth(number), self.scale)

    @cached_property
    def _numbers(self) -> dict[int, int]:
        return {stamp: number for number, stamp in enumerate(self.images.host_time_ns.tolist())}


def _scale(told: Mapping[str, Any]) -> DepthScale:
    try:
        invalid = told["invalid"]
        return DepthScale(
            float(told["scale_m"]), float(told["offset_m"]), None if invalid is None else int(invalid)
        )
    except (KeyError, TypeError, ValueError) as error:
        raise RecordingError(
            f"the event {DEPTH_SCALE} tells no scale of depth ({error}); run `retract recover` on the session"
        ) from error
