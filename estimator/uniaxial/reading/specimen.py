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
        """Length of the specimen that is loaded, m."""
        return self._size("gauge_length") or self._size("grip_separation")

    @property
    def crosshead_length(self) -> Measure | None:
        """Length that the crosshead's travel is spread over, m; None where two are stated that differ."""
        return None if self._two_lengths() else self.gauge_length

    @property
    def extensometer_length(self) -> Measure | None:
        """Length that an extensometer's travel is spread over, m."""
        stated = self.stated.gauge_length is not None
        return self.gauge_length if stated else self._size("extensometer_length") or self.gauge_length

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
        if diameter is None or height is None or self._bore() is not None:
            return None
        return diameter.value / (4 * height.value)

    def require_length(self, where: str, *, extensometer: bool) -> Measure:
        """Return the length that travel is spread over.

        Raises
        ------
        InputError
            Nobody states it, the file does so without a unit, or it states two that may be meant.
        """
        found = self.extensometer_length if extensometer else self.crosshead_length
        if found is None and (two := self._two_lengths()):
            raise InputError(
                f"{where}: the crosshead's travel may be spread over {two[0].source} or {two[1].source}; "
                "add --gauge-length with the right one"
            )
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

    def _two_lengths(self) -> tuple[Measure, Measure] | None:
        """Return gauge length and grip separation where the file states both and they differ."""
        gauge, grips = self._size("gauge_length"), self._size("grip_separation")
        if self.stated.gauge_length is not None or gauge is None or grips is None:
            return None
        return (gauge, grips) if abs(gauge.value / grips.value - 1) > _AGREE else None

    def _size(self, size: Size) -> Measure | None:
        stated: float | None = getattr(self.stated, size, None)
        if stated is not None:
            return Measure(stated, "--" + size.replace("_", "-"))
        fact = self.facts.get(size)
        return None if fact is None or fact.value is None else Measure(fact.value, f"'{fact.text}'")

    def _rectangular(self) -> Measure | None:
        width, thickness = self._size("width"), self._size("thickness") or self._size("wall")
        if width is None or thickness is None:
            return None
        return Measure(width.value * thickness.value, f"{width.source} and {thickness.source}")

    def _round(self) -> Measure | None:
        diameter, bore = self._size("diameter"), self._bore()
        if diameter is None:
            return None
        full = math.pi / 4 * diameter.value**2
        if bore is None or not 0 < bore.value < diameter.value:
            return Measure(full, diameter.source)
        return Measure(full - math.pi / 4 * bore.value**2, f"{diameter.source} and {bore.source}")

    def _bore(self) -> Measure | None:
        """Return the inner diameter of a tube."""
        diameter, inner, wall = (self._size(size) for size in ("diameter", "inner_diameter", "wall"))
        if inner is not None or wall is None or diameter is None:
            return inner
        return Measure(diameter.value - 2 * wall.value, wall.source)

    def _half_stated(self, size: Size) -> str:
        fact = self.facts.get(size)
        if fact is None or fact.value is not None:
            return ""
        return f" ('{fact.text}' has no unit, or is 0)"
