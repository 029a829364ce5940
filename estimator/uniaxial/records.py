"""The record of a tensile or compression test: one loading of one specimen, and how it was come by."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Mode = Literal["tension", "compression"]

DEFAULT_STRAIN_FIT: Mapping[Mode, float] = MappingProxyType({"tension": 0.5, "compression": 0.2})
"""Magnitude of strain up to which laws are fitted unless told otherwise."""


@dataclass(frozen=True, slots=True, eq=False)
class UniaxialRecord:
    """One loading of one specimen.

    Attributes
    ----------
    name : the file's, without its suffix
    mode : of loading
    strain : (n,) engineering strain; compression is negative
    stress : (n,) engineering (nominal) stress, Pa; compression is negative
    facts : what the file states above its table, as text
    path : the file it was read from; None where it was made in memory
    shape_factor : loaded over free area of a cylinder, diameter / (4 height); None where nobody stated its sizes
    strain_from_crosshead : whether strain is the machine's travel, which carries slack and grip slip
    mode_from : what the mode was told from
    found : what was read from where, a sentence each
    assumed : what the file does not say and was supposed, with the reason, a sentence each
    left_out : which rows are not in the record, and why, a sentence each
    """

    name: str
    mode: Mode
    strain: FloatArray
    stress: FloatArray
    facts: Mapping[str, str] = field(default_factory=dict)
    path: Path | None = None
    shape_factor: float | None = None
    strain_from_crosshead: bool = False
    mode_from: str = ""
    found: tuple[str, ...] = ()
    assumed: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
