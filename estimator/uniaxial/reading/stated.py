"""What a user states about a file that does not say it."""

from dataclasses import dataclass
from typing import Literal

from estimator.uniaxial.records import Mode


@dataclass(frozen=True, slots=True)
class Stated:
    """A user's word on what a file leaves open.

    Attributes
    ----------
    mode : of loading
    strain_unit, stress_unit, force_unit, length_unit : of columns without a unit; the last of extensions
    gauge_length, width, thickness, diameter : of the specimen, m; outrank the file's
    area : of its cross-section, m²
    specimen : number, from 1, or label of one of several in a file
    decimal : mark of the numbers
    keep_zero : take the zeros of strain and stress as they are written, so that slack and preload stay in
    """

    mode: Mode | None = None
    strain_unit: str | None = None
    stress_unit: str | None = None
    force_unit: str | None = None
    length_unit: str | None = None
    gauge_length: float | None = None
    width: float | None = None
    thickness: float | None = None
    diameter: float | None = None
    area: float | None = None
    specimen: str | None = None
    decimal: Literal["point", "comma"] | None = None
    keep_zero: bool = False


NOTHING_STATED = Stated()
