"""What a source of uncertainty is: its standard uncertainty, where that comes from, and whose it is."""

from dataclasses import dataclass
from typing import Literal, get_args

Evaluation = Literal["A", "B"]
# Whom to turn to for a smaller one: three devices, the clocks between them, what is held, the mesh and the law, a book.
Device = Literal["force sensor", "robot", "cameras", "clocks", "specimen", "model", "prior knowledge"]
DEVICES: tuple[Device, ...] = get_args(Device)


@dataclass(frozen=True, slots=True)
class Origin:
    """Where the size of an uncertainty comes from.

    Attributes
    ----------
    evaluation : "A", from the statistics of observations, or "B", from anything else (JCGM 100, 2.3.2 and 2.3.3)
    words : a data sheet, a file, a recording, an assumption
    """

    evaluation: Evaluation
    words: str


@dataclass(frozen=True, slots=True)
class Source:
    """A source of uncertainty, independent of all others.

    Attributes
    ----------
    name : as options and files call it
    words : as people do
    device : whose it is
    size : standard uncertainty u(x); of a source with several components, of each
    unit : of the size, SI; "1" for a share, empty for a plain number
    origin : of the size
    known : whether the fit knows of it, so that the estimate's own interval holds it
    """

    name: str
    words: str
    device: Device
    size: float
    unit: str
    origin: Origin
    known: bool
