"""A recorded session played through the protocols of the live devices, at any speed, from any instant.

What the devices told, counters and clocks of their own included, comes back bit for bit; the receive stamps are those
of the replay, as far apart as they were, divided by the speed. Nothing can be moved: the robot only reports.
"""

import threading
import time
from collections.abc import Sequence

import numpy as np

from daq.devices import Devices
from daq.errors import RecordingError
from daq.recording.reader import Recording
from daq.recording.recorded_depth import RecordedDepth
from daq.recording.stored_streams import Images
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import MotionRefusedError
from robot_drivers.protocols import (
    DeviceIdentity,
    Frame,
    IntArray,
    Pose,
    PoseBlock,
    RobotState,
    Speed,
    StreamStatistics,
    WrenchBlock,
)

_POLL_S = 0.002
_MOST_FRAMES = 16


class ReplayClock:
    """Where a replay is in its session. All devices of one replay share it; it may be used from any thread.

    Parameters
    ----------
    begin_ns, end_ns : first and last receive stamp of the session
    speed : seconds of the session in one second
    """

    def __init__(self, begin_ns: int, end_ns: int, speed: float = 1.0) -> None:
        if not 0.0 < speed < float("inf"):
            raise RecordingError(f"replay: a speed of {speed:g} is not possible; give a positive number")
        self.begin_ns, self.end_ns, self.speed = begin_ns, end_ns, speed
        self._lock = threading.Lock()
        self._anchor = (begin_ns, host_time_ns())
        self._seeks = 0

    @property
    def position_ns(self) -> int:
        """The instant of the session that is now, on its own host clock."""
        session_ns, host_ns = self._anchor
        return session_ns + round((host_time_ns() - host_ns) * self.speed)

    @property
    def position_s(self) -> float:
        """Seconds since the session's first sample."""
        return (self.position_ns - self.begin_ns) * 1e-9

    @property
    def finished(self) -> bool:
        """Whether the last sample is due."""
        return self.position_ns > self.end_ns

    @property
    def seeks(self) -> int:
        """How often :meth:`seek` was called."""
        return self._seeks

    def seek(self, position_s: float) -> None:
        """Go on from so many seconds after the first sample, forwards or backwards.

        Raises
        ------
        RecordingError
            The session has no such instant.
        """
        session_ns = self.begin_ns + round(position_s * 1e9)
        if not self.begin_ns <= session_ns <= self.end_ns:
            raise RecordingError(
                f"replay: {position_s:g} s is not in the session, which lasts "
                f"{(self.end_ns - self.begin_ns) * 1e-9:.3f} s"
            )
        with self._lock:
            self._anchor = (session_ns, host_time_ns())
            self._seeks += 1

    def stamp(self, session_ns: IntArray) -> IntArray:
        """Return when these instants of the session are due, on the present host clock."""
        anchor_ns, host_ns = self._anchor
        return host_ns + np.rint((session_ns - anchor_ns) / self.speed).astype(np.int64)


class _ReplayedStream:
    """The samples of one device in the order of their stamps, and how far they have been delivered."""

    def __init__(
        self, identity: DeviceIdentity, clock: ReplayClock, stamps: IntArray, counter: IntArray
    ) -> None:
        self.identity = identity
        self._clock = clock
        self._stamps = stamps
        self._counter = counter
        self._next = 0
        self._seeks = 0
        self._received = 0
        self._lost = 0

    def connect(self) -> None:
        """Nothing has to be found."""

    def close(self) -> None:
        """Nothing has to be released."""

    def statistics(self) -> StreamStatistics:
        """Return the samples delivered, and those that the recorded counter proves missing among them."""
        return StreamStatistics(received=self._received, lost=self._lost)

    def _due(self, timeout_s: float, most: int) -> slice:
        """Wait for a sample and return which ones are due and not delivered."""
        deadline = time.monotonic() + timeout_s
        while True:
            position_ns = self._clock.position_ns
            if self._clock.seeks != self._seeks:
                self._seeks = self._clock.seeks
                self._next = int(np.searchsorted(self._stamps, position_ns))
            end = min(int(np.searchsorted(self._stamps, position_ns, side="right")), self._next + most)
            if end > self._next or time.monotonic() >= deadline:
                break
            time.sleep(_POLL_S)
        due = slice(self._next, end)
        steps = np.diff(self._counter[max(due.start - 1, 0) : end])
        self._lost += int(np.sum(np.maximum(steps - 1, 0)))
        self._received += end - due.start
        self._next = end
        return due


class ReplayedForceSensor(_ReplayedStream):
    """The force sensor of a session."""

    def __init__(self, identity: DeviceIdentity, clock: ReplayClock, samples: WrenchBlock) -> None:
        super().__init__(identity, clock, samples.host_time_ns, samples.counter)
        self._samples = samples

    def start(self) -> None:
        """It streams as soon as it is read."""

    def stop(self) -> None:
        """It streams only when it is read."""

    def read(self, timeout_s: float) -> WrenchBlock:
        """Return the samples that have fallen due."""
        due, samples = self._due(timeout_s, len(self._samples)), self._samples
        return WrenchBlock(
            counter=samples.counter[due],
            device_time_s=samples.device_time_s[due],
            host_time_ns=self._clock.stamp(samples.host_time_ns[due]),
            status=samples.status[due],
            usable=samples.usable[due],
            wrench=samples.wrench[due],
        )


class ReplayedRobot(_ReplayedStream):
    """The robot of a session: it tells where it was, and refuses to move."""

    def __init__(self, identity: DeviceIdentity, clock: ReplayClock, samples: PoseBlock) -> None:
        super().__init__(identity, clock, samples.host_time_ns, samples.counter)
        self._samples = samples

    def state(self) -> RobotState:
        """Return the recorded state of this instant; it is never ready to move."""
        samples = self._samples
        index = max(int(np.searchsorted(samples.host_time_ns, self._clock.position_ns, side="right")) - 1, 0)
        x, y, z = samples.position[index].tolist()
        w, i, j, k = samples.quaternion_wxyz[index].tolist()
        joints = tuple(samples.joints[index].tolist())
        moving = bool(samples.moving[index])
        return RobotState(Pose((x, y, z), (w, i, j, k)), joints, moving, False, False, False, "a recording")

    def move_linear(self, T_base_tool: Pose, speed: Speed, timeout_s: float) -> Pose:
        """Refuse: a recording cannot be moved."""
        raise MotionRefusedError("this robot is a recording and cannot move; connect to the real one")

    def check_trajectory(self, targets: Sequence[Pose], speed: Speed) -> None:
        """Refuse: a recording cannot be moved."""
        raise MotionRefusedError("this robot is a recording and cannot move; connect to the real one")

    def hold(self) -> None:
        """It stands anyway."""

    def resume(self) -> None:
        """It stands all the same."""

    def read(self, timeout_s: float) -> PoseBlock:
        """Return the states that have fallen due."""
        due, samples = self._due(timeout_s, len(self._samples)), self._samples
        return PoseBlock(
            counter=samples.counter[due],
            device_time_s=samples.device_time_s[due],
            host_time_ns=self._clock.stamp(samples.host_time_ns[due]),
            position=samples.position[due],
            quaternion_wxyz=samples.quaternion_wxyz[due],
            joints=samples.joints[due],
            moving=samples.moving[due],
        )


class ReplayedCamera(_ReplayedStream):
    """One camera of a session; images are decoded as they fall due."""

    def __init__(
        self, identity: DeviceIdentity, clock: ReplayClock, images: Images, depth: RecordedDepth
    ) -> None:
        super().__init__(identity, clock, images.host_time_ns, images.counter)
        self._images, self._depth = images, depth

    def read(self, timeout_s: float) -> list[Frame]:
        """Return the images that have fallen due, a few at a time."""
        due, images = self._due(timeout_s, _MOST_FRAMES), self._images
        stamps = self._clock.stamp(images.host_time_ns[due]).tolist()
        frames = []
        for index, stamp in zip(range(due.start, due.stop), stamps, strict=True):
            counter, device_time_s = int(images.counter[index]), float(images.device_time_s[index])
            frames.append(
                Frame(
                    counter=None if counter < 0 else counter,
                    device_time_s=None if np.isnan(device_time_s) else device_time_s,
                    host_time_ns=stamp,
                    pixel_format=images.pixel_format(index),
                    image=images.image(index),
                    depth=self._depth.received_at(int(images.host_time_ns[index])),
                )
            )
        return frames


def replayed(recording: Recording, speed: float = 1.0) -> tuple[Devices, ReplayClock]:
    """Return the devices of a session and the clock that they follow; it runs from now on.

    Raises
    ------
    RecordingError
        The session holds no sample, or the speed is not positive.
    """
    force, robot = recording.force, recording.robot
    images = {name: recording.images(name) for name in recording.cameras}
    streams = [force.host_time_ns, robot.host_time_ns, *(found.host_time_ns for found in images.values())]
    stamps = [stream for stream in streams if len(stream)]
    if not stamps:
        raise RecordingError(f"{recording.folder}: holds no sample; there is nothing to replay")
    begin_ns = min(int(stamp[0]) for stamp in stamps)
    end_ns = max(int(stamp[-1]) for stamp in stamps)
    clock = ReplayClock(begin_ns, end_ns, speed)
    known = recording.info.devices
    roles = ("force sensor", "robot", *(f"camera {name}" for name in images))
    identities = {
        role: known.get(role, DeviceIdentity(role, "unknown", "", str(recording.folder))) for role in roles
    }
    devices = Devices(
        ReplayedForceSensor(identities["force sensor"], clock, force),
        ReplayedRobot(identities["robot"], clock, robot),
        {
            name: ReplayedCamera(
                identities[f"camera {name}"], clock, found, RecordedDepth.of(recording, name)
            )
            for name, found in images.items()
        },
    )
    return devices, clock
