"""The quantities of a soak that must stay flat: over time as a table, and whether they did."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from gui.soak.meter import Second

_PARTS = 10


@dataclass(frozen=True, slots=True)
class Quantity:
    """One quantity, and by how much its usual value may grow from the first tenth of the time to the last.

    Attributes
    ----------
    name, unit : for a person
    of : its value in a second
    most_growth : in its unit
    """

    name: str
    unit: str
    of: Callable[[Second], float]
    most_growth: float


QUANTITIES = (
    Quantity("memory of the window", "MiB", lambda s: s.window.memory_mib, 50.0),
    Quantity("memory of the recorder", "MiB", lambda s: s.recorder.memory_mib, 50.0),
    Quantity("threads of the window", "", lambda s: s.window.threads, 4.0),
    Quantity("threads of the recorder", "", lambda s: s.recorder.threads, 4.0),
    Quantity("handles of the window", "", lambda s: s.window.handles, 4.0),
    Quantity("handles of the recorder", "", lambda s: s.recorder.handles, 4.0),
    Quantity("latency of the window", "ms", lambda s: 1e3 * s.window_late_s, 20.0),
    Quantity("latency of the recorder", "ms", lambda s: 1e3 * s.recorder_late_s, 20.0),
)


@dataclass(frozen=True, slots=True)
class Series:
    """A quantity over the time of a soak.

    Attributes
    ----------
    usual : (10,) medians over the tenths of the time; fewer where there are not so many seconds
    most : of all seconds
    """

    quantity: Quantity
    usual: tuple[float, ...]
    most: float

    @property
    def growth(self) -> float:
        """From the first tenth to the last."""
        return self.usual[-1] - self.usual[0]

    @property
    def flat(self) -> bool:
        """Whether it grew by no more than it may; nothing flat is known of what was not measured."""
        return self.growth <= self.quantity.most_growth

    def __str__(self) -> str:
        name = f"{self.quantity.name}{f', {self.quantity.unit}' if self.quantity.unit else ''}"
        usual = " ".join(f"{value:7.1f}" for value in self.usual)
        verdict = "flat" if self.flat else "GROWS"
        return f"{name:28s} {usual}   most {self.most:7.1f}   {self.growth:+7.1f} {verdict}"


def series_of(seconds: Sequence[Second]) -> tuple[Series, ...]:
    """Return all quantities over the time; at least one second."""
    made = []
    for quantity in QUANTITIES:
        values = np.array([quantity.of(second) for second in seconds], dtype=np.float64)
        tenths = np.array_split(values, min(_PARTS, len(values)))
        known = values[np.isfinite(values)]
        usual = tuple(_median(tenth) for tenth in tenths)
        made.append(Series(quantity, usual, float(known.max()) if len(known) else float("nan")))
    return tuple(made)


def _median(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else float("nan")


def table(series: Sequence[Series], minutes: float) -> str:
    """Return the quantities over time as lines of text."""
    count = max(len(one.usual) for one in series)
    ends = " ".join(f"{minutes * number / count:7.1f}" for number in range(1, count + 1))
    return "\n".join([f"{'median until minute':28s} {ends}", *map(str, series)])
