"""What has come of each stream, how much of it is written, how old it is and how well its clock is known."""

from collections.abc import Callable, Iterable

from daq.acquisition.live_view import LiveView
from daq.acquisition.messages import StreamCounts
from daq.devices import Devices
from daq.recording.streams import FORCE, ROBOT, camera_stream
from daq.session.session import Session
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import DeviceError
from robot_drivers.protocols import StreamStatistics

_SYNC_PERIOD_NS = 1_000_000_000


class Counting:
    """Counts the streams of connected devices."""

    def __init__(self, devices: Devices, live: LiveView) -> None:
        self._live = live
        self._statistics = {FORCE: devices.force_sensor.statistics, ROBOT: devices.robot.statistics}
        for name, camera in devices.cameras.items():
            self._statistics[camera_stream(name)] = camera.statistics
        self._sync_s: dict[str, float] = {}
        self._sync_due_ns = 0

    def counts(self, session: Session | None) -> dict[str, StreamCounts]:
        """Return the counts of every stream; what is written and dropped is that of the running session."""
        written = session.written() if session is not None else {}
        dropped = session.dropped() if session is not None else {}
        self._watch_clocks(self._statistics)
        counts = {}
        for stream, ask in self._statistics.items():
            statistics = _counted(ask)
            counts[stream] = StreamCounts(
                statistics.received,
                statistics.lost,
                written.get(stream, 0),
                dropped.get(stream, 0),
                self._live.age_s(stream),
                self._sync_s.get(stream, float("nan")),
            )
        return counts

    def _watch_clocks(self, streams: Iterable[str]) -> None:
        """Look how well the clocks are known, now and then: it costs more than a count."""
        if (now_ns := host_time_ns()) >= self._sync_due_ns:
            self._sync_due_ns = now_ns + _SYNC_PERIOD_NS
            self._sync_s = {stream: self._live.sync_s(stream) for stream in streams}


def _counted(ask: Callable[[], StreamStatistics]) -> StreamStatistics:
    """Return the counts of a device, none while it is not connected."""
    try:
        return ask()
    except DeviceError:
        return StreamStatistics()
