"""The box's sample number as a clock: a number that wraps, asked for at any time, becomes seconds."""

from dataclasses import dataclass

_TOLERANCE_S = 0.5
"""A sample number further than this from where the host clock expects it belongs to a box powered up anew."""


@dataclass(frozen=True, slots=True)
class _Newest:
    number: int
    tick: int
    host_time_ns: int


class SampleClock:
    """Follows the sample number of one stream.

    The host clock only decides how often the number wrapped since the sample before. A box that was powered up anew
    begins a new epoch: the device time falls back to 0, for nothing tells how the two relate. 16-bit numbers wrap so
    often that one restart in ten of those that take seconds escapes notice; its time is off by less than
    0.5 s then.

    Attributes
    ----------
    repeated, restarts : numbers seen before, and new epochs
    """

    def __init__(self, span: int, rate_hz: float) -> None:
        self.repeated = 0
        self.restarts = 0
        self._span = span
        self._rate_hz = rate_hz
        self._newest: _Newest | None = None

    def time_s(self, number: int, host_time_ns: int) -> float | None:
        """Return the device time of a sample received at a host time; None for one that was there before."""
        newest = self._newest
        tick = number
        if newest is not None:
            expected = (host_time_ns - newest.host_time_ns) * 1e-9 * self._rate_hz
            step = (number - newest.number) % self._span
            step += self._span * round((expected - step) / self._span)
            if abs(step - expected) > _TOLERANCE_S * self._rate_hz:
                self.restarts += 1
                tick = 0
            elif step <= 0:
                self.repeated += 1
                return None
            else:
                tick = newest.tick + step
        self._newest = _Newest(number, tick, host_time_ns)
        return tick / self._rate_hz
