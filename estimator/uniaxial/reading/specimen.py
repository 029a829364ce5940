"""The specimen's length and cross-section, from the user's word or the file's facts."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from estimator.errors import InputError
from estimator.uniaxial.reading.facts import SizeFact
from estimator.uniaxial.reading.language.vocabulary import Size
from estimator.uniaxial.reading.stated import Stated

_AGREE = 0.02


@dataclass(frozen=True, slots=True)
class Measure:
    """A length, m, or area, m², and what it was taken from."""

    value: float
    source: str


@dataclass(frozen=True, slots=True)
class Specimen:
    """What is known of the specimen's sizes.

    Attributes
    ----------
    stated : the user's word, which goes first
    facts : the file's
    """

    stated: Stated
    facts: Mapping[Size, SizeFact]

    @property
    def gauge_length(self) -> Measure | None:
        """Length that strain refers to, m."""
        return self._size("gauge_length")

    @property
    def area(self) -> Measure | None:
        """Cross-section, m²."""
        stated = self.stated
        if stated.area is None and (
            stated.diameter is not None or None not in (stated.width, stated.thickness)
        ):
            return self._round() if stated.diameter is not None else self._rectangular()
        return self._size("area") or self._rectangular() or self._round()

    @property
    def shape_factor(self) -> float | None:
        """Loaded over free area of a cylinder, diameter / (4 height)."""
        diameter, height = self._size("diameter"), self.gauge_length
        return None if diameter is None or height is None else diameter.value / (4 * height.value)

    def require_gauge_length(self, where: str) -> Measure:
        """Return the gauge length.

        Raises
        ------
        InputError
            Nobody states it, or the file does so without a unit.
        """
        found = self.gauge_length
        if found is None:
            raise InputError(
                f"{where}: strain from travel needs the gauge length{self._half_stated('gauge_length')}; "
                "add --gauge-length '20 mm', with yours"
            )
        return found

    def require_area(self, where: str) -> Measure:
        """Return the cross-section.

        Raises
        ------
        InputError
            Nobody states it or what it follows from, or the file does so without a unit, or contradicts itself.
        """
        found = self.area
        if found is None:
            half = "".join(self._half_stated(size) for size in ("area", "width", "thickness", "diameter"))
            raise InputError(
                f"{where}: stress from load needs the cross-section{half}; "
                "add --area '20 mm2', or --width and --thickness, or --diameter, with yours"
            )
        product = self._rectangular()
        if self.stated.area is None and product is not None and abs(product.value / found.value - 1) > _AGREE:
            raise InputError(
                f"{where}: {found.source} and {product.source} contradict each other; add --area with the right one"
            )
        return found

    def _size(self, size: Size) -> Measure | None:
        stated: float | None = getattr(self.stated, size)
        if stated is not None:
            return Measure(stated, "--" + size.replace("_", "-"))
        fact = self.facts.get(size)
        return None if fact is None or fact.value is None else Measure(fact.value, f"'{fact.text}'")

    def _rectangular(self) -> Measure | None:
        width, thickness = self._size("width"), self._size("thickness")
        if width is None or thickness is None:
            return None
        return Measure(width.value * thickness.value, f"{width.source} and {thickness.source}")

    def _round(self) -> Measure | None:
        diameter = self._size("diameter")
        return None if diameter is None else Measure(math.pi / 4 * diameter.value**2, diameter.source)

    def _half_stated(self, size: Size) -> str:
        fact = self.facts.get(size)
        if fact is None or fact.value is not None:
            return ""
        return f" ('{fact.text}' has no unit, or is 0)"
