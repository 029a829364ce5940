"""What a kind of input is to the campaign: how a valid one is made, what damages it, and who reads it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from daq.bad_input.damage.any_file import Damage
from daq.bad_input.damage.places import PLACES, Place


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of input.

    Attributes
    ----------
    name : in tables
    write : makes a valid input in an empty folder
    damages : what may befall each of its files, by their pattern in that folder
    read : reads the whole input in that folder, as the verbs do before they begin to compute
    command : arguments of ``retract`` that read it, from that folder and one for what is written; none where it is
        read in the middle of something longer
    changes : files of the input that reading may change, by their names
    places : what may stand in the place of its files
    quick : its command takes a second, so that it is carried out on forms that the reader takes, too
    """

    name: str
    write: Callable[[Path], None]
    damages: Mapping[str, Sequence[Damage]]
    read: Callable[[Path], object]
    command: Callable[[Path, Path], Sequence[str]] | None = None
    changes: frozenset[str] = frozenset()
    places: Sequence[Place] = PLACES
    quick: bool = False
