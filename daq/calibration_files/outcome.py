"""What every calibration ends in: a result, the figures that speak for or against it, and a plot."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, Literal, TypeVar

if TYPE_CHECKING:  # who only looks what is in force, as every session does, needs no plots
    from matplotlib.figure import Figure as Plot

R = TypeVar("R")

Kind = Literal["camera", "cameras", "stereo", "robot", "force", "time", "tool"]
KINDS: tuple[Kind, ...] = ("camera", "cameras", "stereo", "robot", "force", "time", "tool")

# Figures that an uncertainty budget takes up.
TURN_STD = "turn of the tissue frame, standard deviation"
HELD_OUT_SCALE = "held-out scale, off by"


@dataclass(frozen=True, slots=True)
class Figure:
    """One number and what it has to be: at most ``most``, at least ``least``; None where nothing is asked."""

    name: str
    value: float
    unit: str
    most: float | None = None
    least: float | None = None

    @property
    def passed(self) -> bool:
        """Whether the value is as it has to be; a value that is no number is not."""
        above = self.least is None or self.value >= self.least
        below = self.most is None or self.value <= self.most
        return self.value == self.value and above and below

    def describe(self) -> str:
        """Return one line: name, value, what was asked, and whether it is so."""
        asked = [
            f"{word} {limit:.4g}"
            for word, limit in (("at most", self.most), ("at least", self.least))
            if limit is not None
        ]
        verdict = "" if self.passed else "  <- not met"
        demand = f" ({', '.join(asked)})" if asked else ""
        return f"{self.name}: {self.value:.4g} {self.unit}{demand}{verdict}"


@dataclass(frozen=True, slots=True)
class Outcome(Generic[R]):
    """A calibration that is done and not kept yet.

    Attributes
    ----------
    kind : which calibration
    result : a dataclass that a TOML file can hold
    figures : what speaks for or against it
    draw : draws into an empty figure of matplotlib
    notes : what else there is to tell, a line each
    """

    kind: Kind
    result: R
    figures: tuple[Figure, ...]
    draw: "Callable[[Plot], None]"
    notes: tuple[str, ...] = ()

    @property
    def acceptable(self) -> bool:
        """Whether every figure is as it has to be."""
        return all(figure.passed for figure in self.figures)

    def describe(self) -> str:
        """Return the notes and figures, a line each, and the verdict."""
        verdict = "acceptable" if self.acceptable else "to be rejected"
        return "\n".join(
            [*self.notes, *(figure.describe() for figure in self.figures), f"{self.kind}: {verdict}"]
        )
