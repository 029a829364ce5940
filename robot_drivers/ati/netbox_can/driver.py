"""Driver of a Net F/T box on its native CAN protocol, by which the box sends resolved counts when asked.

A sample's counter is the number of its request. The driver never biases by itself.
"""

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from robot_drivers.ati.can.force_sensor import CanForceSensor
from robot_drivers.ati.can.link import Answer, CanLink
from robot_drivers.ati.can.poller import Sample
from robot_drivers.ati.netbox_can.frames import (
    BIAS,
    LONG_SAMPLES,
    SHORT_SAMPLES,
    Reading,
    command,
    decode_long,
    decode_short,
    long_request,
    short_request,
)
from robot_drivers.ati.netbox_can.sample_clock import SampleClock
from robot_drivers.ati.netbox_can.settings import NetBoxCanSettings
from robot_drivers.ati.transducer.status import STATUS_MAPS, StatusMap
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import ConfigurationError
from robot_drivers.protocols import DeviceIdentity, WrenchBlock

_RATE_MEASUREMENT_S = 0.1
_RATE_TOLERANCE = 0.1
_SHORT_STATUS_SHIFT = {"upper": 16, "lower": 0}
_LARGEST_COUNT = {"long": 2**31 - 2, "short": 2**15 - 2}  # a channel at the end of its range is clipped


class _Box:
    """A box that answered on an open bus."""

    def __init__(self, link: CanLink, settings: NetBoxCanSettings) -> None:
        self._link = link
        self._settings = settings
        long = settings.answer == "long"
        self._request = (
            long_request(settings.base, settings.long_request_code) if long else short_request(settings.base)
        )
        self.sample_numbers = LONG_SAMPLES if long else SHORT_SAMPLES
        factors = np.ones(6) if long else np.array(settings.scale_factors)
        scaling = settings.scaling
        self.si_per_count = factors * scaling.si_per_count
        self.largest_usable = np.minimum(
            settings.rated_wrench, _LARGEST_COUNT[settings.answer] * self.si_per_count
        )
        self.status_map = _status_map(settings)
        if settings.sample_rate_hz:
            self._check_sample_rate(settings.sample_rate_hz)
        status = self.reading(self.poll()).status
        self.identity = DeviceIdentity(
            kind="force sensor",
            model="ATI Net F/T on CAN",
            serial=settings.transducer_serial,
            address=f"{settings.interface}:{settings.channel}, base {settings.base:#05x}",
            details={
                "answer": settings.answer,
                "units": f"{scaling.force_unit}, {scaling.torque_unit}",
                "counts per unit": f"{scaling.counts_per_force:g}, {scaling.counts_per_torque:g}",
                "status": "; ".join(self.status_map.describe(status)) or "healthy",
            },
        )

    def poll(self) -> Answer:
        """Ask for a sample."""
        return self._link.ask(self._request)

    def recover(self) -> None:
        """Let the rest of an answer that came late go by, lest it is mistaken for the next one."""
        self._link.wait_for_silence()

    def begin(self) -> "_Decoder":
        """Begin a stream."""
        return _Decoder(self, self._settings)

    def reading(self, answer: Answer) -> Reading:
        """Decode an answer; the status word is the 32-bit one, as far as the answer carries it."""
        if self._settings.answer == "long":
            return decode_long(answer.frames, self._settings.long_order)
        short = decode_short(answer.frames)
        return replace(short, status=short.status << _SHORT_STATUS_SHIFT[self._settings.short_status])

    def send(self, code: int) -> None:
        """Send a request that is not answered."""
        self._link.ask(command(self._settings.base, code))

    def _check_sample_rate(self, rate_hz: float) -> None:
        """Refuse a rate of the sample number that is not the box's: every device time would be wrong."""
        first = self.poll()
        time.sleep(_RATE_MEASUREMENT_S)
        second = self.poll()
        advance = (self.reading(second).sample - self.reading(first).sample) % self.sample_numbers
        shortest_s = (second.requested_ns - first.received_ns) * 1e-9
        longest_s = (second.received_ns - first.requested_ns) * 1e-9
        slowest, fastest = (1 - _RATE_TOLERANCE) * rate_hz, (1 + _RATE_TOLERANCE) * rate_hz
        if not slowest * shortest_s <= advance <= fastest * longest_s:
            raise ConfigurationError(
                f"the box's sample number advances by {advance / longest_s:.0f} to {advance / shortest_s:.0f} a "
                f"second, sample_rate_hz says {rate_hz:g}: correct it, or set it to 0 if the number is no clock"
            )


class _Decoder:
    """Turns counts into wrenches; the stream begins with its construction."""

    def __init__(self, box: _Box, settings: NetBoxCanSettings) -> None:
        self._box = box
        self._start_ns = host_time_ns()
        rate_hz = settings.sample_rate_hz
        self._clock = SampleClock(box.sample_numbers, rate_hz) if rate_hz else None

    @property
    def repeated(self) -> int:
        """Samples that were there before."""
        return self._clock.repeated if self._clock else 0

    @property
    def restarts(self) -> int:
        """How often the box was powered up anew."""
        return self._clock.restarts if self._clock else 0

    def block(self, samples: Sequence[Sample]) -> WrenchBlock:
        """Convert; a bad status word, a clipped channel or an axis beyond its rating forbids a sample."""
        kept, readings, times_s = [], [], []
        for sample in samples:
            reading = self._box.reading(sample.answer)
            time_s = self._time_s(reading, sample.answer)
            if time_s is not None:
                kept.append(sample)
                readings.append(reading)
                times_s.append(time_s)
        counts = np.array([reading.counts for reading in readings], np.int64).reshape(-1, 6)
        status = np.array([reading.status for reading in readings], np.int64)
        wrench = counts * self._box.si_per_count
        in_range = (np.abs(wrench) <= self._box.largest_usable).all(axis=1)
        return WrenchBlock(
            counter=np.array([sample.counter for sample in kept], np.int64),
            device_time_s=np.array(times_s, np.float64),
            host_time_ns=np.array([sample.answer.received_ns for sample in kept], np.int64),
            status=status,
            usable=self._box.status_map.usable(status) & in_range,
            wrench=wrench,
        )

    def _time_s(self, reading: Reading, answer: Answer) -> float | None:
        if self._clock is None:
            return (answer.requested_ns - self._start_ns) * 1e-9
        return self._clock.time_s(reading.sample, answer.received_ns)


class NetBoxCan(CanForceSensor[_Box]):
    """A :class:`~robot_drivers.protocols.ForceSensor` on a Net F/T box's CAN connector."""

    def __init__(self, settings: NetBoxCanSettings) -> None:
        super().__init__(
            settings,
            f"Net Box with base {settings.base:#05x} on {settings.channel}",
            lambda link: _Box(link, settings),
        )
        self._box_settings = settings

    def describe_status(self, status: int) -> tuple[str, ...]:
        """Return one line for each bit set in a status word."""
        return _status_map(self._box_settings).describe(status)

    def set_bias(self) -> None:
        """Make the box subtract the present load from now on (not acknowledged)."""
        self._connected().send(BIAS)

    def reset_latch(self) -> None:
        """Clear the box's threshold latch (not acknowledged)."""
        self._connected().send(self._box_settings.clear_latch_code)


def _status_map(settings: NetBoxCanSettings) -> StatusMap:
    return STATUS_MAPS[settings.status_map].with_usable(settings.usable_status)
