"""Which devices are lost, and how they are connected again between sessions."""

from collections.abc import Sequence

from daq.devices import Devices
from daq.recording.streams import FORCE, ROBOT, camera_stream
from robot_drivers.errors import DeviceError
from robot_drivers.protocols import Camera, ForceSensor, Frame, PoseBlock, Robot, WrenchBlock


class Connections:
    """An observer that notes which devices fail, and connects them again when it is asked to. Nothing moves."""

    def __init__(self, devices: Devices) -> None:
        cameras = {camera_stream(name): camera for name, camera in devices.cameras.items()}
        self._robot = devices.robot
        self._devices: dict[str, ForceSensor | Robot | Camera] = {
            FORCE: devices.force_sensor,
            ROBOT: devices.robot,
            **cameras,
        }
        self._lost: dict[str, DeviceError] = {}

    def on_wrench(self, block: WrenchBlock) -> None:
        """Samples tell nothing of a connection that they do not come by."""

    def on_pose(self, block: PoseBlock) -> None:
        """Poses may come by another way than commands go."""

    def on_frames(self, camera: str, frames: Sequence[Frame]) -> None:
        """Images tell nothing either."""

    def on_failure(self, stream: str, error: DeviceError) -> None:
        """Note a device that has failed."""
        self._lost[stream] = error

    def look(self) -> None:
        """Ask whether the robot answers: it may be lost while its poses still come."""
        try:
            self._robot.state()
        except DeviceError as error:
            self._lost[ROBOT] = error

    @property
    def lost(self) -> bool:
        """Whether a device is known to be lost."""
        return bool(self._lost)

    def restore(self) -> None:
        """Connect anew what is lost; what is not there yet stays lost. A robot that was held stays held."""
        for stream in list(self._lost):
            device = self._devices[stream]
            device.close()
            try:
                device.connect()
            except DeviceError as error:
                self._lost[stream] = error
            else:
                del self._lost[stream]

    def require(self) -> None:
        """Connect anew what is lost, and raise the DeviceError of what is not there."""
        self.restore()
        for error in self._lost.values():
            raise error
