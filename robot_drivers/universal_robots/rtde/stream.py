"""The samples of a connection: a thread takes them as they come, stamps them, counts by the controller's clock."""

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from robot_drivers.clock import host_time_ns
from robot_drivers.errors import DeviceError, DeviceProtocolError, DeviceTimeoutError
from robot_drivers.protocols import StreamStatistics
from robot_drivers.real_time import prefer_this_thread
from robot_drivers.universal_robots.rtde.connection import RTDEConnection
from robot_drivers.universal_robots.rtde.packages import Kind, Recipe, Value, text_of

TIMESTAMP = "timestamp"

_LONGEST_QUEUE = 100_000
_LONGEST_WAIT_S = 0.05


@dataclass(frozen=True, slots=True)
class Sample:
    """What the controller told at one instant.

    Attributes
    ----------
    counter : of the controller's cycles at the rate asked for, from its clock; a gap is a cycle that was not told
    device_time_s : the controller's clock
    host_time_ns : receive stamp
    values : by the names of the variables
    """

    counter: int
    device_time_s: float
    host_time_ns: int
    values: Mapping[str, Value]


class SampleClock:
    """Counts cycles by the controller's clock, which begins anew when the controller does.

    Attributes
    ----------
    lost, duplicated, restarts : cycles that were not told, told twice, and new beginnings of the clock
    """

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._last: tuple[float, int] | None = None
        self.lost = self.duplicated = self.restarts = 0

    def count(self, device_time_s: float) -> int | None:
        """Return the counter of a sample; None for one that was told before."""
        if self._last is None:
            counter = 0
        else:
            before_s, before = self._last
            cycles = round((device_time_s - before_s) * self._rate_hz)
            if cycles == 0:
                self.duplicated += 1
                return None
            if cycles < 0:
                self.restarts += 1
            self.lost += max(cycles, 1) - 1
            counter = before + max(cycles, 1)
        self._last = (device_time_s, counter)
        return counter


class RTDEStream:
    """Reads a started connection from construction to :meth:`close`.

    Parameters
    ----------
    recipe : of the outputs, among them ``timestamp``
    silence_limit_s : without a sample for so long, the controller counts as lost
    on_sample : called in the thread of the stream with each new sample; None for nobody
    """

    def __init__(
        self,
        connection: RTDEConnection,
        recipe: Recipe,
        rate_hz: float,
        silence_limit_s: float,
        on_sample: Callable[[Sample], None] | None = None,
    ) -> None:
        self._connection, self._recipe = connection, recipe
        self._silence_limit_s, self._on_sample = silence_limit_s, on_sample
        self._clock = SampleClock(rate_hz)
        self._changed = threading.Condition()
        self._samples: deque[Sample] = deque(maxlen=_LONGEST_QUEUE)
        self._received = self._malformed = 0
        self._failure: DeviceError | None = None
        self._closing = False
        self.newest: Sample | None = None
        self.told = ""
        self._thread = threading.Thread(target=self._serve, name="ur-rtde", daemon=True)
        self._thread.start()

    def take(self, timeout_s: float) -> list[Sample]:
        """Return the samples since the last call, waiting so long for a first one.

        Raises
        ------
        DeviceError
            The connection is lost, and everything before that was taken.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._samples or self._failure, timeout_s)
            samples = list(self._samples)
            self._samples.clear()
            if not samples and self._failure is not None:
                raise self._failure
        return samples

    def wait_for_first(self, timeout_s: float) -> Sample:
        """Return the newest sample once there is one; raises DeviceError where none comes."""
        with self._changed:
            self._changed.wait_for(lambda: self.newest or self._failure, timeout_s)
            self.check()
            if self.newest is None:
                raise DeviceTimeoutError(f"the {self._connection.name} told nothing in {timeout_s:g} s")
            return self.newest

    def check(self) -> None:
        """Raise what has ended the stream."""
        if self._failure is not None:
            raise self._failure

    def statistics(self) -> StreamStatistics:
        """Return the counts."""
        clock = self._clock
        return StreamStatistics(
            received=self._received,
            lost=clock.lost,
            duplicated=clock.duplicated,
            restarts=clock.restarts,
            malformed=self._malformed,
        )

    def close(self) -> None:
        """End the thread; the connection stays."""
        self._closing = True
        if threading.current_thread() is not self._thread:
            self._thread.join()

    def _serve(self) -> None:
        prefer_this_thread()
        heard = time.monotonic()
        try:
            while not self._closing:
                packages = self._connection.receive(_LONGEST_WAIT_S)
                stamp = host_time_ns()
                for package in packages:
                    if package.kind is Kind.TEXT:
                        self.told = text_of(package)
                    if package.kind is Kind.DATA:
                        heard = time.monotonic()
                        self._see(package.content, stamp)
                if time.monotonic() - heard > self._silence_limit_s:
                    raise DeviceTimeoutError(
                        f"the {self._connection.name} told nothing for {self._silence_limit_s:g} s; connect again"
                    )
        except DeviceError as error:
            with self._changed:
                self._failure = error
                self._changed.notify_all()

    def _see(self, content: bytes, stamp: int) -> None:
        try:
            values = self._recipe.decode(content)
        except DeviceProtocolError:
            self._malformed += 1
            return
        time_s = float(values[TIMESTAMP])  # type: ignore[arg-type] # a double by its type
        counter = self._clock.count(time_s)
        if counter is None:
            return
        sample = Sample(counter, time_s, stamp, values)
        if self._on_sample is not None:
            self._on_sample(sample)
        with self._changed:
            self._received += 1
            self.newest = sample
            self._samples.append(sample)
            self._changed.notify_all()
