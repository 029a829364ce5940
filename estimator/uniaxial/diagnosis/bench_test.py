"""A whole bench test of one specimen: all cycles, holds and rates, not the first loading alone."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from estimator.uniaxial.records import FloatArray

BenchMode = Literal["tension", "compression", "shear"]


@dataclass(frozen=True, slots=True, eq=False)
class BenchTest:
    """All rows of a test, as magnitudes that grow while it loads.

    Attributes
    ----------
    name : the file's, without its suffix
    mode : of loading; shear is simple shear
    strain : (n,) engineering strain, or amount of shear, towards loading
    stress : (n,) nominal stress towards loading, Pa
    time : (n,) s; None where nothing tells it
    shape_factor : loaded over free area of a cylinder, diameter / (4 height); None where nobody stated its sizes
    gauge_length, area : of the specimen, m and m²; None where nobody stated them
    strain_on_specimen : whether strain was measured on the specimen itself, so that machine and clamps are not in it
    path : the file it was read from; None where it was made in memory
    found, assumed, left_out : how it was read, a sentence each
    """

    name: str
    mode: BenchMode
    strain: FloatArray
    stress: FloatArray
    time: FloatArray | None = None
    shape_factor: float | None = None
    gauge_length: float | None = None
    area: float | None = None
    strain_on_specimen: bool = False
    path: Path | None = None
    found: tuple[str, ...] = ()
    assumed: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
