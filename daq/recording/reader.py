"""Reading a session folder: every stream as arrays exactly as the driver delivered it, images on demand."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from daq.errors import RecordingError
from daq.recording.damage import telling_damage
from daq.recording.folder import SessionInfo, read_info
from daq.recording.layout import CAMERAS_FILE, SIGNALS_FILE, camera_frame, depth_of
from daq.recording.messages import rows
from daq.recording.recovery import recover_session
from daq.recording.scanning.recognition import is_own_topic
from daq.recording.scanning.scan import scan
from daq.recording.scanning.segments import Scan
from daq.recording.stored_streams import (
    Event,
    Images,
    cameras_of,
    events_of,
    force_of,
    images_of,
    messages_of,
    robot_of,
)
from robot_drivers.protocols import PoseBlock, WrenchBlock


class Recording:
    """A session folder, sealed or not; a sample whose records were cut off or damaged is not there.

    Raises
    ------
    RecordingError
        It is no session, or it was sealed and is damaged.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.info: SessionInfo = read_info(folder)
        self._signals = scan(folder / SIGNALS_FILE)
        self._images = scan(folder / CAMERAS_FILE)
        for name, found in ((SIGNALS_FILE, self._signals), (CAMERAS_FILE, self._images)):
            if self.info.state != "recording":
                _require_undamaged(folder, name, found)
            _require_own(folder / name, found)

    @property
    def unchecked(self) -> int:
        """Messages that no checksum covers, as in files that another program has written again without any."""
        segments = [*self._signals.segments, *self._images.segments]
        return sum(sum(map(len, one.offsets.values())) for one in segments if not one.checked)

    @property
    def events(self) -> list[Event]:
        """All events in the order of their recording."""
        with telling_damage(self.folder / SIGNALS_FILE):
            return events_of(self._signals)

    @property
    def force(self) -> WrenchBlock:
        """The whole force stream, sensor frame."""
        with telling_damage(self.folder / SIGNALS_FILE):
            return force_of(self._signals)

    @property
    def robot(self) -> PoseBlock:
        """The whole robot stream."""
        with telling_damage(self.folder / SIGNALS_FILE):
            return robot_of(self._signals)

    @property
    def cameras(self) -> tuple[str, ...]:
        """The names of the recorded cameras."""
        with telling_damage(self.folder / CAMERAS_FILE):
            return cameras_of(self._images)

    def camera_info(self, camera: str) -> NDArray[np.void]:
        """Return the recorded intrinsics of a camera in the fields of ``CameraInfo``, (n,); mostly one or none."""
        with telling_damage(self.folder / CAMERAS_FILE):
            return _camera_info(self._images, camera)["body"]

    def images(self, camera: str) -> Images:
        """Return the images of one camera; raises RecordingError for an unknown one."""
        if camera not in self.cameras:
            raise RecordingError(f"{self.folder}: has no camera {camera!r}, only {', '.join(self.cameras)}")
        with telling_damage(self.folder / CAMERAS_FILE):
            return images_of(self._images, camera)

    def depth(self, camera: str) -> Images:
        """Return the images of depth of one camera, none where it has no depth."""
        with telling_damage(self.folder / CAMERAS_FILE):
            return images_of(self._images, depth_of(camera))


def _camera_info(found: Scan, camera: str) -> NDArray[np.void]:
    layout = rows.camera_info_layout(camera_frame(camera))
    return messages_of(found, f"/camera/{camera}/camera_info", layout)


def _require_undamaged(folder: Path, name: str, found: Scan) -> None:
    """Raise RecordingError where a sealed file is not as it was sealed."""
    faults = found.faults
    if not faults and not found.sealed:
        faults = ["its end is missing"]
    if faults:
        more = f", and {len(faults) - 1} more" if len(faults) > 1 else ""
        raise RecordingError(
            f"{folder / name}: is damaged ({faults[0]}{more}); restore it from a copy, or run "
            f"`retract recover {folder}`, which keeps what is whole and tells what is lost"
        )


def _require_own(path: Path, found: Scan) -> None:
    """Raise RecordingError where a file has messages, and none of a session."""
    topics = [topic for topic, count in found.counts().items() if count]
    if topics and not any(is_own_topic(topic) for topic in topics):
        raise RecordingError(
            f"{path}: is an MCAP file of profile {found.profile!r} by {found.library!r} with the topics "
            f"{', '.join(topics[:4])}; only sessions that this software recorded are read"
        )


def open_recording(folder: Path) -> Recording:
    """Open a session; one that was cut off is recovered first, and ``info.problems`` tells so.

    Raises
    ------
    RecordingError
        It is being recorded, or it is no session.
    """
    if read_info(folder).state == "recording":
        recover_session(folder)
    return Recording(folder)
