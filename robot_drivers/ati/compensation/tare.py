"""Zero a force sensor by arithmetic: readings stay as they are, a tare says what to subtract and how sure that is.

A tare is the mean over a time in which nothing moves. It is refused, with the reason, when something does: a zero
taken while the load changes would stay as a constant force in everything that follows.
"""

from dataclasses import dataclass

import numpy as np

from robot_drivers.ati.transducer.gamma import GAGE_NOISE_STD
from robot_drivers.errors import ConfigurationError, DeviceError
from robot_drivers.protocols import FloatArray, WrenchBlock

_SEGMENTS = 10
_NOISE_ALLOWANCE = 6.5  # standard errors; white noise spreads ten means further in one case out of 5000
_CHANNELS = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
_UNITS = ("N", "N", "N", "N·m", "N·m", "N·m")


class TareRefusedError(DeviceError):
    """The signal is not fit for a zero; the message says why."""


@dataclass(frozen=True, slots=True)
class TareConditions:
    """What a signal must be like to be taken for zero.

    Attributes
    ----------
    duration_s : shortest time; a multiple of 0.2 s lets each of its tenths span whole periods of 50 Hz pick-up
    samples : fewest samples
    wander : (6,) N and N·m by which the means of the tenths may differ beyond what their noise explains; by default
        eight times the noise of one count on every gage of a Gamma
    """

    duration_s: float = 0.2
    samples: int = 50
    wander: tuple[float, ...] = tuple(8 * std for std in GAGE_NOISE_STD)

    def __post_init__(self) -> None:
        if len(self.wander) != 6 or not all(limit > 0 for limit in self.wander):
            raise ConfigurationError(f"tare conditions: wander {self.wander} must be six positive numbers")
        if not self.duration_s > 0 or self.samples < 2 * _SEGMENTS:
            raise ConfigurationError(
                f"tare conditions: {self.samples} samples in {self.duration_s} s; a positive time and at least "
                f"{2 * _SEGMENTS} samples are needed"
            )


@dataclass(frozen=True, slots=True)
class Tare:
    """A zero, and the state of the signal while it was taken; arrays (6,) in N and N·m, sensor frame.

    Attributes
    ----------
    offset : mean reading
    offset_std : standard error of that mean, from the scatter of ten part means, so that slow noise counts
    noise_std : standard deviation of one sample about the straight line through all
    drift_per_s, drift_std : slope of that line and its standard error, per second
    duration_s, samples : what it rests on
    host_time_ns : host clock in the middle
    """

    offset: FloatArray
    offset_std: FloatArray
    noise_std: FloatArray
    drift_per_s: FloatArray
    drift_std: FloatArray
    duration_s: float
    samples: int
    host_time_ns: int

    def apply(self, wrench: FloatArray) -> FloatArray:
        """Return readings (..., 6) with the zero subtracted."""
        return wrench - self.offset

    def statement(self) -> str:
        """Say in one line for each channel how good the zero is."""
        lines = [f"tare of {self.samples} samples in {self.duration_s:.2f} s"]
        for channel, unit, offset, std, noise, drift, drift_std in zip(
            _CHANNELS,
            _UNITS,
            self.offset,
            self.offset_std,
            self.noise_std,
            self.drift_per_s,
            self.drift_std,
            strict=True,
        ):
            lines.append(
                f"{channel} {offset:+.5f} ± {std:.5f} {unit}, noise {noise:.5f} {unit}, "
                f"drift {drift:+.5f} ± {drift_std:.5f} {unit}/s"
            )
        return "\n".join(lines)


@dataclass(frozen=True, slots=True)
class TareStack:
    """The tares taken so far; the last is in force. Each is of the readings as they came, not of the one before."""

    tares: tuple[Tare, ...] = ()

    def push(self, tare: Tare) -> "TareStack":
        """Return the stack with another tare in force."""
        return TareStack((*self.tares, tare))

    def undo(self) -> "TareStack":
        """Return the stack without its last tare; without any, readings are as they came.

        Raises
        ------
        TareRefusedError
            There is none.
        """
        if not self.tares:
            raise TareRefusedError("there is no tare to undo: the readings are as the sensor sends them")
        return TareStack(self.tares[:-1])

    def apply(self, wrench: FloatArray) -> FloatArray:
        """Return readings (..., 6) with the tare in force subtracted."""
        return self.tares[-1].apply(wrench) if self.tares else wrench


def take_tare(block: WrenchBlock, conditions: TareConditions | None = None) -> Tare:
    """Take the mean of a block for zero.

    Raises
    ------
    TareRefusedError
        The block is too short, holds samples that are not usable or has some missing, or the load moves.
    """
    conditions = conditions or TareConditions()
    _check_samples(block, conditions)
    time_s = block.device_time_s - block.device_time_s.mean()
    segments = np.array_split(np.arange(len(block)), _SEGMENTS)
    means = np.array([block.wrench[segment].mean(axis=0) for segment in segments])
    segment_time_s = np.array([time_s[segment].mean() for segment in segments])
    drift = time_s @ block.wrench / (time_s @ time_s)
    offset = block.wrench.mean(axis=0)
    residual = block.wrench - offset - np.outer(time_s, drift)
    noise = residual.std(axis=0, ddof=2)
    _check_rest(means, noise / np.sqrt(len(block) / _SEGMENTS), drift, conditions)
    spread = means - offset - np.outer(segment_time_s, drift)
    segment_std = np.sqrt((spread**2).sum(axis=0) / (_SEGMENTS - 2))
    return Tare(
        offset=offset,
        offset_std=means.std(axis=0, ddof=1) / np.sqrt(_SEGMENTS),
        noise_std=noise,
        drift_per_s=drift,
        drift_std=segment_std / np.sqrt(segment_time_s @ segment_time_s),
        duration_s=_duration_s(block),
        samples=len(block),
        host_time_ns=int(block.host_time_ns[len(block) // 2]),
    )


def _check_samples(block: WrenchBlock, conditions: TareConditions) -> None:
    if len(block) < conditions.samples:
        raise TareRefusedError(
            f"{len(block)} samples are too few for a zero: {conditions.samples} are needed"
        )
    unusable = len(block) - int(block.usable.sum())
    if unusable:
        raise TareRefusedError(
            f"{unusable} of {len(block)} samples are not usable (fault, saturation or overload): unload the sensor"
        )
    steps = np.diff(block.counter)
    if (steps != 1).any():
        raise TareRefusedError(
            f"samples are missing in {int((steps != 1).sum())} places: take the zero again"
        )
    duration_s = _duration_s(block)
    if duration_s < conditions.duration_s:
        raise TareRefusedError(
            f"{duration_s:.3f} s is too short for a zero: {conditions.duration_s} s are needed"
        )


def _duration_s(block: WrenchBlock) -> float:
    """Return the time that the samples stand for, one period each, to the microsecond."""
    return round(float(np.ptp(block.device_time_s)) * len(block) / (len(block) - 1), 6)


def _check_rest(
    means: FloatArray, means_std: FloatArray, drift: FloatArray, conditions: TareConditions
) -> None:
    """Refuse when the means of the segments (10, 6) differ by more than wander and noise allow."""
    wander = np.ptp(means, axis=0)
    excess = wander - _NOISE_ALLOWANCE * means_std - conditions.wander
    if (excess > 0).any():
        reasons = [
            f"{channel} wanders by {wander[i]:.4f} {unit} (allowed {conditions.wander[i]:.4f}; "
            f"drift {drift[i]:+.4f} {unit}/s)"
            for i, (channel, unit) in enumerate(zip(_CHANNELS, _UNITS, strict=True))
            if excess[i] > 0
        ]
        raise TareRefusedError(
            f"the load is not at rest: {'; '.join(reasons)}; wait, then take the zero again"
        )
