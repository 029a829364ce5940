"""What emulated transducers can feel: where the gages of a Gamma end, and where an Axia tells that its range ends."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from robot_drivers.ati.transducer.gamma import GAGE_MATRIX
from robot_drivers.protocols import FloatArray, IntArray

_FULL_GAGE = 32767
_SI_PER_GAGE = 1e-6 * GAGE_MATRIX.T  # multiplies rows of gage counts from the right
_GAGES_PER_SI = np.linalg.inv(_SI_PER_GAGE)


class Transducer(Protocol):
    """A transducer behind the electronics.

    Attributes
    ----------
    latched : status word of a monitor condition that has tripped
    """

    @property
    def latched(self) -> int: ...  # noqa: D102

    def felt(self, ticks: IntArray, wrench: FloatArray, saturated: bool) -> tuple[FloatArray, IntArray]:
        """Return what it makes of a wrench (n, 6) at internal samples (n,), and its status words (n,).

        ``saturated`` puts all gages at the end of their range.
        """


class GammaGages:
    """A Gamma on a Net F/T box: gages that end before the axes do."""

    latched = 0x8001_0000
    _SATURATED = 0x8002_0000

    def felt(self, ticks: IntArray, wrench: FloatArray, saturated: bool) -> tuple[FloatArray, IntArray]:
        """Clip the gages; a sample with one at its end tells so."""
        gages = wrench @ _GAGES_PER_SI
        if saturated:
            gages[:] = _FULL_GAGE
        ended = np.abs(gages).max(axis=1) >= _FULL_GAGE
        if ended.any():
            wrench = np.clip(gages, -_FULL_GAGE, _FULL_GAGE) @ _SI_PER_GAGE
        return wrench, np.where(ended, self._SATURATED, 0)


class AxiaRange:
    """An Axia: 105 % of its calibrated range, by force and torque together, as its manual adds them up.

    Source: 9610-05-Ethernet Axia-09, section 4.8.1: Fxy beside Tz, and Fz beside Txy. The bit stays for 32 samples.

    Parameters
    ----------
    rated_wrench : (6,) its range, N and N·m
    """

    latched = 0x0001_0000
    _OUT_OF_RANGE = 0xC000_0000
    _GAGES_AT_THEIR_END = 0xC800_0004
    _HELD_TICKS = 32
    _FULL_SHARE = 1.05

    def __init__(self, rated_wrench: tuple[float, ...]) -> None:
        self._rated = np.array(rated_wrench)
        self._last_out: int | None = None

    def felt(self, ticks: IntArray, wrench: FloatArray, saturated: bool) -> tuple[FloatArray, IntArray]:
        """Tell each sample whose load is beyond the range, and those shortly after it."""
        if saturated:
            full = np.broadcast_to(1.5 * self._rated, wrench.shape)
            return full, np.full(len(ticks), self._GAGES_AT_THEIR_END, np.int64)
        out = self._beyond(wrench)
        newest = np.maximum.accumulate(np.where(out, ticks, np.iinfo(np.int64).min // 2))
        if self._last_out is not None:
            newest = np.maximum(newest, self._last_out)
        if len(newest) and out.any():
            self._last_out = int(newest[-1])
        return wrench, np.where(ticks - newest <= self._HELD_TICKS, self._OUT_OF_RANGE, 0)

    def _beyond(self, wrench: FloatArray) -> NDArray[np.bool_]:
        share = np.abs(wrench) / self._rated
        across = np.hypot(wrench[:, 0], wrench[:, 1]) / self._rated[0] + share[:, 5]
        along = share[:, 2] + np.hypot(wrench[:, 3], wrench[:, 4]) / self._rated[3]
        return np.maximum(across, along) > self._FULL_SHARE
