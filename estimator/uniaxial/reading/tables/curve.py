"""Strain and stress in SI, from the columns of a table that hold them, or from load and travel."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.uniaxial.reading.language.units import factor_of
from estimator.uniaxial.reading.language.vocabulary import CROSSHEAD_WORDS, EXTENSOMETER_WORDS
from estimator.uniaxial.reading.language.words import has_word
from estimator.uniaxial.reading.specimen import Measure, Specimen
from estimator.uniaxial.reading.tables.choosing import ABSCISSAE, ORDINATES, Choice, choose, column_of
from estimator.uniaxial.reading.tables.column_units import missing_unit, required_factor, unit_of
from estimator.uniaxial.reading.tables.columns import Table
from estimator.uniaxial.records import FloatArray

LARGEST_STRAIN = 20.0
"""Beyond what silicones bear, which is 17."""

_LARGEST_CERTAIN_FRACTION = 1.0
_AGREE = 0.05
_STRAIN_UNITS: Mapping[str, float] = MappingProxyType({"-": 1.0, "%": 1e-2})
_STRESS_UNITS: Mapping[str, float] = MappingProxyType(
    {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "psi": 6894.757293168}
)


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """All rows of a test, with the signs of the file.

    Attributes
    ----------
    strain : (n,) engineering strain
    stress : (n,) engineering stress, Pa
    lines : (n,) line of each row
    time : (n,) where there is such a column
    height_grows : whether a column of the specimen's height grows or falls; None without such a column
    from_crosshead : whether strain is the machine's travel
    over_first : whether strain is over the first value of the specimen's height, which nothing else states
    abscissa, ordinate : the columns used
    found, assumed : a sentence each
    """

    strain: FloatArray
    stress: FloatArray
    lines: NDArray[np.intp]
    time: FloatArray | None
    height_grows: bool | None
    from_crosshead: bool
    over_first: bool
    abscissa: Choice
    ordinate: Choice
    found: tuple[str, ...]
    assumed: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class _Axis:
    """One quantity in SI, and how it was come by."""

    values: FloatArray
    told: str
    assumed: tuple[str, ...] = ()
    over_first: bool = False


def curve_of(table: Table, specimen: Specimen) -> Curve:
    """Return strain and stress.

    Raises
    ------
    InputError
        A cell is no number, a unit or a size is missing, or is stated twice and differently.
    """
    abscissa, ordinate = choose(table.block, ABSCISSAE), choose(table.block, ORDINATES)
    strain = _strain(table, specimen, abscissa)
    stress = _stress(table, specimen, ordinate)
    time, height = column_of(table.block, "time"), column_of(table.block, "height")
    heights = None if height is None else table.numbers_or_none(height.column)
    doubts = (
        _doubt(abscissa, strain, _over_length(table, specimen), "travel over length"),
        _doubt(ordinate, stress, _over_area(table, specimen), "load over area"),
    )
    return Curve(
        strain=strain.values,
        stress=stress.values,
        lines=table.lines,
        time=None if time is None else table.numbers_or_none(time.column),
        height_grows=None if heights is None else _grows(heights),
        from_crosshead=abscissa.quantity in ("extension", "position")
        or has_word(abscissa.title.text, CROSSHEAD_WORDS),
        over_first=strain.over_first,
        abscissa=abscissa,
        ordinate=ordinate,
        found=(strain.told, stress.told),
        assumed=(*strain.assumed, *stress.assumed, *(doubt for doubt in doubts if doubt)),
    )


def _strain(table: Table, specimen: Specimen, choice: Choice) -> _Axis:
    values = table.numbers(choice.column)
    if choice.quantity == "strain":
        return _strain_as_such(table, specimen, choice, values)
    factor, unit = required_factor(table, choice, specimen.stated)
    lengths, told = values * factor, _told("strain", choice, unit)
    if choice.quantity == "height":
        gauge = specimen.gauge_length
        if gauge is None and lengths[0] > 0:
            return _Axis(lengths / lengths[0] - 1, f"{told}, over its first value", over_first=True)
        gauge = gauge or specimen.require_length(table.block.grid.where, extensometer=False)
        return _Axis(lengths / gauge.value - 1, f"{told}, over {gauge.source}")
    first = _first_height(table, specimen)
    gauge = first or specimen.require_length(
        table.block.grid.place(table.block.header_line), extensometer=_by_extensometer(choice)
    )
    told = f"{told}, over {gauge.source}"
    reasons: tuple[str, ...] = ()
    if choice.quantity == "position" and lengths[0] != 0:
        where = f"its first value, {values[0]:g} {unit}"
        lengths, reasons = (
            lengths - lengths[0],
            (f"{choice.title.text!r} is a position: travel counts from {where}",),
        )
    return _Axis(lengths / gauge.value, told, reasons, over_first=first is not None)


def _first_height(table: Table, specimen: Specimen) -> Measure | None:
    """Return the first value of a column of the specimen's height, where no length is stated."""
    height = None if specimen.gauge_length is not None else column_of(table.block, "height")
    values = None if height is None else table.numbers_or_none(height.column)
    if height is None or values is None or height.title.unit is None or values[0] <= 0:
        return None
    first = float(values[0]) * factor_of(height.title.unit, "length", height.title.text)
    return Measure(first, f"the first value of {height.title.text!r}, {values[0]:g} {height.title.unit}")


def _strain_as_such(table: Table, specimen: Specimen, choice: Choice, values: FloatArray) -> _Axis:
    unit = unit_of(table, choice, specimen.stated)
    if unit is not None:
        return _Axis(values * factor_of(unit, "strain", choice.title.text), _told("strain", choice, unit))
    supposed, reason = _unit_of_strain(table, specimen, choice, values)
    words = "a fraction" if supposed == "-" else "a percentage"
    assumed = f"{choice.title.text!r} has no unit and is taken for {words}: {reason}"
    return _Axis(values * _STRAIN_UNITS[supposed], _told("strain", choice, supposed), (assumed,))


def _unit_of_strain(table: Table, specimen: Specimen, choice: Choice, values: FloatArray) -> tuple[str, str]:
    """Return the unit of a strain that has none, and the reason.

    A fraction of less than 1 may be a percentage only in a test of stiff material; between 1 and the largest strain of
    any silicone it may well be either.
    """
    for other, reason in (
        (_over_length(table, specimen), "so it is travel over length"),
        (_from_true_strain(table), "so true strain is its logarithm"),
    ):
        for unit, factor in _STRAIN_UNITS.items():
            if other is not None and _agree(other, values * factor):
                return unit, reason
    largest = float(np.abs(values).max(initial=0.0))
    if largest <= _LARGEST_CERTAIN_FRACTION:
        return "-", f"it stays within {largest:.3g}"
    if largest > LARGEST_STRAIN:
        return "%", f"it reaches {largest:.3g}, and no material bears that many times its length"
    raise InputError(missing_unit(table, choice, f" and reaches {largest:.3g}, which may be a fraction or %"))


def _stress(table: Table, specimen: Specimen, choice: Choice) -> _Axis:
    values = table.numbers(choice.column)
    if choice.quantity == "force":
        factor, unit = required_factor(table, choice, specimen.stated)
        area = specimen.require_area(table.block.grid.place(table.block.header_line))
        return _Axis(values * factor / area.value, f"{_told('stress', choice, unit)}, over {area.source}")
    stated = unit_of(table, choice, specimen.stated)
    if stated is not None:
        return _Axis(values * factor_of(stated, "stress", choice.title.text), _told("stress", choice, stated))
    other = _over_area(table, specimen)
    for supposed, factor in _STRESS_UNITS.items():
        if other is not None and _agree(other, values * factor):
            assumed = (
                f"{choice.title.text!r} has no unit and is taken for {supposed}: so it is load over area"
            )
            return _Axis(values * factor, _told("stress", choice, supposed), (assumed,))
    raise InputError(missing_unit(table, choice))


def _over_length(table: Table, specimen: Specimen) -> FloatArray | None:
    """Return strain from a column of travel, where all that it needs is stated."""
    travel = column_of(table.block, "extension")
    if travel is None:
        return None
    gauge = specimen.extensometer_length if _by_extensometer(travel) else specimen.crosshead_length
    values = table.numbers_or_none(travel.column)
    if gauge is None or values is None or travel.title.unit is None:
        return None
    return values * factor_of(travel.title.unit, "length", travel.title.text) / gauge.value


def _by_extensometer(choice: Choice) -> bool:
    return has_word(choice.title.text, EXTENSOMETER_WORDS)


def _over_area(table: Table, specimen: Specimen) -> FloatArray | None:
    """Return stress from a column of load, where all that it needs is stated."""
    load = column_of(table.block, "force")
    area = specimen.area
    values = None if load is None else table.numbers_or_none(load.column)
    if load is None or area is None or values is None or load.title.unit is None:
        return None
    return values * factor_of(load.title.unit, "force", load.title.text) / area.value


def _from_true_strain(table: Table) -> FloatArray | None:
    """Return engineering strain from a column of true strain whose unit is none or a fraction."""
    true = column_of(table.block, "strain", "true")
    values = None if true is None else table.numbers_or_none(true.column)
    if true is None or values is None or true.title.unit == "%" or np.abs(values).max(initial=0.0) > 5:
        return None
    return np.asarray(np.expm1(values))


def _doubt(choice: Choice, axis: _Axis, other: FloatArray | None, name: str) -> str:
    """Return what speaks against a column of strain or stress: the same from others, which is another."""
    if other is None or choice.quantity not in ("strain", "stress"):
        return ""
    ratio = _ratio(other, axis.values)
    if ratio is None or abs(ratio - 1) <= _AGREE:
        return ""
    return (
        f"{choice.title.text!r} is taken as it stands, although {name} is {ratio:.3g} times as large; "
        "check the sizes and units"
    )


def _agree(one: FloatArray, other: FloatArray) -> bool:
    ratio = _ratio(one, other)
    return ratio is not None and abs(ratio - 1) <= _AGREE


def _ratio(one: FloatArray, other: FloatArray) -> float | None:
    """Return how many times as large a column is as another, in the rows where that one is large."""
    large = np.abs(other) > 0.5 * np.abs(other).max(initial=0.0)
    return float(np.median(np.abs(one[large]) / np.abs(other[large]))) if large.any() else None


def _grows(heights: FloatArray) -> bool | None:
    farthest = heights[int(np.argmax(np.abs(heights - heights[0])))]
    return None if farthest == heights[0] else bool(farthest > heights[0])


def _told(what: str, choice: Choice, unit: str) -> str:
    others = f" (not {', '.join(map(repr, choice.others[:3]))})" if choice.others else ""
    named = "a fraction" if unit in ("-", "1") else unit
    return f"{what} from column {choice.column + 1}, {choice.title.text!r}, in {named}{others}"
