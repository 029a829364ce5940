"""A handover as it lies in its folder."""

from dataclasses import dataclass
from pathlib import Path

from estimator.handover.comparison import Compared
from estimator.handover.model import HandedOver


@dataclass(frozen=True)
class Written:
    """A handover as it lies in its folder.

    Attributes
    ----------
    folder : with all files
    files : their names
    handed : what the engine got
    compared : of each experiment, empty where the engine was not run
    not_run : why it was not
    notes : what the result did not tell
    version : of the engine that was run
    """

    folder: Path
    files: tuple[str, ...]
    handed: HandedOver
    compared: tuple[Compared, ...]
    not_run: str
    notes: tuple[str, ...]
    version: str
