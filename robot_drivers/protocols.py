"""What every device of a kind can do: the three protocols, and the plain types that cross them.

Samples come in blocks of arrays, so that a 7 kHz stream costs no object per sample. SI units throughout. Every
stream carries the device's own counter and clock and the host's receive stamp; none is ever altered.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

JOINT_COUNTS = (6, 7)
"""How many joints a robot may have."""


@dataclass(frozen=True, slots=True)
class DeviceIdentity:
    """Who a connected device is; ``details`` holds what else it told (firmware, units, rates), as text."""

    kind: str
    model: str
    serial: str
    address: str
    details: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class StreamStatistics:
    """Counts since the stream started; a sample missing from ``lost`` was never missed."""

    received: int = 0
    lost: int = 0
    duplicated: int = 0
    late: int = 0
    restarts: int = 0
    malformed: int = 0


@dataclass(frozen=True, slots=True)
class WrenchBlock:
    """Consecutive force/torque samples, sensor frame, as read: no bias removed, no sign changed.

    Attributes
    ----------
    counter : (n,) int64, the device's sample counter, unwrapped
    device_time_s : (n,) float64, the device's clock, s
    host_time_ns : (n,) int64, receive stamp on the host clock, ns (the kernel's where the system offers it)
    status : (n,) int64, the device's status word
    usable : (n,) bool, False where the status word or a saturated channel forbids using the sample
    wrench : (n, 6) float64, Fx Fy Fz in N, Tx Ty Tz in N·m
    """

    counter: IntArray
    device_time_s: FloatArray
    host_time_ns: IntArray
    status: IntArray
    usable: NDArray[np.bool_]
    wrench: FloatArray

    def __len__(self) -> int:
        return len(self.counter)


@dataclass(frozen=True, slots=True)
class Pose:
    """A rigid transformation such as ``T_base_tool``: position in m, unit quaternion with the scalar first."""

    position: tuple[float, float, float]
    quaternion_wxyz: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class PoseBlock:
    """Consecutive robot states.

    Attributes
    ----------
    counter : (n,) int64, the device's message counter, unwrapped
    device_time_s : (n,) float64, controller clock, s
    host_time_ns : (n,) int64, receive stamp on the host clock, ns
    position : (n, 3) float64, origin of the tool frame in the base frame, m
    quaternion_wxyz : (n, 4) float64, orientation of the tool frame in the base frame
    joints : (n, 6) or (n, 7) float64, joint angles, rad
    moving : (n,) bool
    """

    counter: IntArray
    device_time_s: FloatArray
    host_time_ns: IntArray
    position: FloatArray
    quaternion_wxyz: FloatArray
    joints: FloatArray
    moving: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.counter)


@dataclass(frozen=True, slots=True)
class RobotState:
    """The controller's present state; ``ready`` means that a motion command would be accepted.

    ``joints`` holds the angle of each joint, rad.
    """

    T_base_tool: Pose
    joints: tuple[float, ...]
    moving: bool
    motors_on: bool
    ready: bool
    stopped: bool
    message: str = ""


@dataclass(frozen=True, slots=True)
class Speed:
    """Upper bounds of a motion: linear in m/s, angular in rad/s."""

    linear: float
    angular: float


@dataclass(frozen=True, slots=True)
class DepthScale:
    """What the counts of a depth image mean: depth in m is ``scale_m`` times the count, plus ``offset_m``.

    ``invalid`` is the count of pixels whose depth is not known; None where the camera knows that of every pixel.
    """

    scale_m: float
    offset_m: float = 0.0
    invalid: int | None = None


@dataclass(frozen=True, slots=True)
class DepthImage:
    """Depth along the optical axis, as the camera counts it, in the pixels of the image that it comes with.

    Attributes
    ----------
    counts : (height, width)
    scale : what they mean
    """

    counts: NDArray[np.uint16]
    scale: DepthScale


@dataclass(frozen=True, slots=True)
class Frame:
    """One camera image.

    ``counter`` and ``device_time_s`` come from the camera (None where it tells neither), ``host_time_ns`` is the
    receive stamp. ``pixel_format`` is ``"mono8"``, ``"bgr8"`` or ``"bayer_rggb8"`` and its three siblings. ``depth``
    comes from a depth camera only.
    """

    counter: int | None
    device_time_s: float | None
    host_time_ns: int
    pixel_format: str
    image: NDArray[np.uint8]
    depth: DepthImage | None = None


class ForceSensor(Protocol):
    """A six-axis force/torque sensor. Connecting never biases it."""

    @property
    def identity(self) -> DeviceIdentity:
        """Who the device is; known once connected."""

    def connect(self) -> None:
        """Find the device and learn its settings."""

    def start(self) -> None:
        """Begin streaming."""

    def read(self, timeout_s: float) -> WrenchBlock:
        """Return everything that arrived since the last call; wait up to ``timeout_s`` for a first sample.

        An empty block means that nothing came in that time.
        """

    def statistics(self) -> StreamStatistics:
        """Return the counts since the stream started."""

    def stop(self) -> None:
        """End streaming."""

    def close(self) -> None:
        """Release the device; may be called more than once."""


class Robot(Protocol):
    """A robot arm. Nothing moves on connect, on reconnect or on a retry."""

    @property
    def identity(self) -> DeviceIdentity:
        """Who the device is; known once connected."""

    def connect(self) -> None:
        """Find the device and learn its settings."""

    def state(self) -> RobotState:
        """Return the controller's present state."""

    def check_trajectory(self, targets: Sequence[Pose], speed: Speed) -> None:
        """Raise MotionRefusedError where straight lines from here through all ``targets`` break a limit."""

    def move_linear(self, T_base_tool: Pose, speed: Speed, timeout_s: float) -> Pose:
        """Move the tool along a straight line, wait until it stands there, return the pose reached."""

    def hold(self) -> None:
        """Stop at once and stay; may be called from any thread. Motion needs :meth:`resume` first."""

    def resume(self) -> None:
        """Allow motion again after :meth:`hold`; moves nothing by itself."""

    def read(self, timeout_s: float) -> PoseBlock:
        """Return the state samples that arrived since the last call, as :meth:`ForceSensor.read` does."""

    def statistics(self) -> StreamStatistics:
        """Return the counts since the stream started."""

    def close(self) -> None:
        """Release the device; may be called more than once."""


class Camera(Protocol):
    """A camera that delivers frames by itself."""

    @property
    def identity(self) -> DeviceIdentity:
        """Who the device is; known once connected."""

    def connect(self) -> None:
        """Find the device and learn its settings."""

    def read(self, timeout_s: float) -> Sequence[Frame]:
        """Return the frames that arrived since the last call, oldest first; empty when none came in time."""

    def statistics(self) -> StreamStatistics:
        """Return the counts since the stream started."""

    def close(self) -> None:
        """Release the device; may be called more than once."""
