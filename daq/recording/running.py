"""Reading a session while it is recorded: each look takes what was written since the one before."""

from pathlib import Path

from daq.blocks import joined
from daq.errors import RecordingError
from daq.recording.damage import telling_damage
from daq.recording.folder import SessionInfo, read_info
from daq.recording.layout import CAMERAS_FILE, SIGNALS_FILE, depth_of
from daq.recording.scanning.scan import scan_on
from daq.recording.scanning.segments import Scan
from daq.recording.stored_streams import Event, Images, cameras_of, events_of, force_of, images_of, robot_of
from robot_drivers.protocols import PoseBlock, WrenchBlock


class RunningRecording:
    """What a session folder holds so far: nothing before the first :meth:`read_on`.

    Attributes
    ----------
    folder, info : of the session
    events : in the order of their recording
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.info: SessionInfo = read_info(folder)
        self.events: list[Event] = []
        self._force: list[WrenchBlock] = []
        self._robot: list[PoseBlock] = []
        self._images: dict[str, Images] = {}
        self._depths: dict[str, Images] = {}
        self._signals, self._cameras = Scan(), Scan()

    def read_on(self) -> None:
        """Take what was written since the last time; raises RecordingError where a file is damaged or no recording."""
        signals, cameras = self.folder / SIGNALS_FILE, self.folder / CAMERAS_FILE
        with telling_damage(signals):
            self._signals = scan_on(signals, self._signals)
            self.events += events_of(self._signals)
            self._force.append(force_of(self._signals))
            self._robot.append(robot_of(self._signals))
        with telling_damage(cameras):
            self._cameras = scan_on(cameras, self._cameras)
            for camera in cameras_of(self._cameras):
                _read_on(self._images, camera, images_of(self._cameras, camera))
                _read_on(self._depths, camera, images_of(self._cameras, depth_of(camera)))

    @property
    def sealed(self) -> bool:
        """Whether nothing more will come."""
        return self._signals.sealed and self._cameras.sealed

    @property
    def force(self) -> WrenchBlock:
        """The force stream so far, sensor frame."""
        self._force = [joined(self._force)]
        return self._force[0]

    @property
    def robot(self) -> PoseBlock:
        """The robot stream so far."""
        self._robot = [joined(self._robot)]
        return self._robot[0]

    @property
    def cameras(self) -> tuple[str, ...]:
        """The names of the recorded cameras."""
        return tuple(self._images)

    def images(self, camera: str) -> Images:
        """Return the images of one camera so far; raises RecordingError for an unknown one."""
        if camera not in self._images:
            raise RecordingError(f"{self.folder}: has no camera {camera!r}, only {', '.join(self.cameras)}")
        return self._images[camera]

    def depth(self, camera: str) -> Images:
        """Return the images of depth of one camera so far; raises RecordingError for an unknown one."""
        self.images(camera)
        return self._depths[camera]

    def let_go_images(self, before_ns: int) -> None:
        """Give up the pixels of the images that were received before an instant; their stamps stay."""
        for streams in (self._images, self._depths):
            for camera, images in streams.items():
                streams[camera] = images.without_pixels(images.host_time_ns < before_ns)


def _read_on(streams: dict[str, Images], camera: str, fresh: Images) -> None:
    before = streams.get(camera)
    streams[camera] = fresh if before is None else before.followed_by(fresh)
