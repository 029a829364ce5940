"""What a soak has measured, what it is held to, and whether it held."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

from daq.recording.streams import camera_stream
from gui.soak.meter import LONGEST_BLOCK_S, Second
from gui.soak.series import Series, table

_CAMERAS = 2
_SHOWN_PER_S = 30.0
_SHOWN_SHARE = 0.95
_FEWEST_REPAINTS = 20_000


@dataclass(frozen=True, slots=True)
class SoakResult:
    """What a run measured, after its first tenth.

    Attributes
    ----------
    minutes, wanted_minutes : of measuring; fewer than wanted where the run was interrupted
    series : the quantities that must stay flat
    sessions : recorded and sealed
    troubles : why sessions did not end well
    longest_block_s : between two ticks of the interface thread, beyond the tick
    longest_work_s : processor time of the interface thread between two ticks; less than the block where others had
        the processor
    blocks : times that the interface thread was blocked for longer than 100 ms
    telemetry_per_s : shown
    images_per_s : of each camera, shown in the usual second in which the recorder read the devices
    repaints : of all widgets
    cpu_share : of the window's process, of one core
    load_average : of the machine, over the last minute
    received_per_s : samples of each stream
    """

    minutes: float
    wanted_minutes: float
    series: tuple[Series, ...]
    sessions: int
    troubles: tuple[str, ...]
    longest_block_s: float
    longest_work_s: float
    blocks: int
    telemetry_per_s: float
    images_per_s: dict[str, float]
    repaints: int
    cpu_share: float
    load_average: float
    received_per_s: dict[str, float]

    @property
    def bars(self) -> dict[str, bool]:
        """What it is held to, in words, and whether it held.

        Of the images as many must be shown as the cameras delivered, but for one in twenty, up to 30 a second.
        """
        shown = all(
            rate >= _SHOWN_SHARE * min(self.received_per_s.get(camera_stream(camera), 0.0), _SHOWN_PER_S)
            for camera, rate in self.images_per_s.items()
        )
        return {
            "memory, threads, handles and latencies are flat": all(one.flat for one in self.series),
            f"no block of {1e3 * LONGEST_BLOCK_S:g} ms": self.longest_block_s < LONGEST_BLOCK_S,
            f"both cameras shown as they deliver, up to {_SHOWN_PER_S:g}/s": shown
            and len(self.images_per_s) == _CAMERAS,
            f"{_FEWEST_REPAINTS} repaints": self.repaints >= _FEWEST_REPAINTS,
            "every session ended well": not self.troubles,
            f"measured for {self.wanted_minutes:g} min": self.minutes > 0.99 * self.wanted_minutes,
        }

    @property
    def passed(self) -> bool:
        """Whether every bar held."""
        return all(self.bars.values())

    def as_json(self) -> dict[str, Any]:
        """Return it as plain values."""
        values = {name: getattr(self, name) for name in self.__slots__ if name != "series"}
        told = {
            one.quantity.name: {
                "unit": one.quantity.unit,
                "usual": one.usual,
                "most": one.most,
                "flat": one.flat,
            }
            for one in self.series
        }
        return {**values, "series": told, "passed": self.passed}

    def __str__(self) -> str:
        shown = ", ".join(f"{name} {rate:.1f}" for name, rate in self.images_per_s.items())
        received = ", ".join(f"{name} {rate:.0f}/s" for name, rate in self.received_per_s.items())
        return "\n".join(
            [
                f"{self.minutes:.1f} min, load of the machine {self.load_average:.1f}, received {received}",
                table(self.series, self.minutes),
                f"  interface thread: longest block {1e3 * self.longest_block_s:.0f} ms, of which it worked "
                f"{1e3 * self.longest_work_s:.0f} ms at most; {self.blocks} blocks over 100 ms",
                f"  shown: telemetry {self.telemetry_per_s:.1f}/s, images {shown} /s; {self.repaints} repaints",
                f"  window's process: {100 * self.cpu_share:.0f} % of one core; {self.sessions} sessions recorded",
                *(f"  {trouble}" for trouble in self.troubles),
                *(f"  {'passed' if held else 'FAILED'}: {bar}" for bar, held in self.bars.items()),
            ]
        )


def images_shown_per_s(seconds: Sequence[Second]) -> dict[str, float]:
    """Return the usual rate of each camera; while it judges and seals a session the recorder reads no device."""
    reading = [second for second in seconds if not math.isnan(second.recorder_late_s)]
    cameras = sorted({camera for second in reading for camera in second.images})
    return {
        camera: median(second.images.get(camera, 0) / second.duration_s for second in reading)
        for camera in cameras
    }
