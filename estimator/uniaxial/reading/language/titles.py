"""What the title of a column says: the quantity, its unit, and in which direction the specimen was loaded."""

import re
from dataclasses import dataclass

from estimator.uniaxial.reading.language.units import dimension_of, spelt
from estimator.uniaxial.reading.language.vocabulary import (
    COLUMN_WORDS,
    MEASURE_WORDS,
    MODE_WORDS,
    NOMINAL_WORDS,
    UNITS,
    Dimension,
    Measure,
    Quantity,
)
from estimator.uniaxial.reading.language.words import has_word
from estimator.uniaxial.records import Mode

_BRACKETS = re.compile(r"[(\[{]([^()\[\]{}]*)[)\]}]")
_BEHIND = re.compile(r"^(.*?\S)(?:\s+in\s+|\s*/\s*|[\s_,:]\s*)([^\s_,:]+)$")
_PER_LENGTH = re.compile(r"[\s_]mm[\s_]mm$", re.IGNORECASE)
_MULTIPLE = re.compile(
    r"[x×*·/]\s*1(?:0*[eE][+-]?\d+|0\s*(?:\^|\*\*)\s*[-+\u2212]?\d+|0[⁻⁺]?[⁰¹²³⁴⁵⁶⁷⁸⁹]+|0+)(?!\d)"
)
_LONGEST_UNIT = 6
_LONGEST_TITLE = 200
# what a column is where its unit says more than its word
_BY_UNIT: dict[tuple[Quantity, Dimension], Quantity] = {
    ("strain", "length"): "extension",
    ("extension", "strain"): "strain",
    ("height", "strain"): "other",
    ("position", "strain"): "strain",
    ("force", "stress"): "stress",
    ("stress", "force"): "force",
}


@dataclass(frozen=True, slots=True)
class Title:
    """A column's title, understood.

    Attributes
    ----------
    text : as it stands in the file
    quantity : of the column; None where no word is known
    unit : in the vocabulary's spelling; None where none is stated
    unknown_unit : what stands in the place of a unit and is none
    measure : of strain or stress, where the title names another than the engineering one
    nominal : whether the title says that it is per initial size
    mode : of loading, where the title says so
    """

    text: str
    quantity: Quantity | None
    unit: str | None
    unknown_unit: str | None
    measure: Measure | None
    nominal: bool
    mode: Mode | None


def understood(text: str, unit_below: str = "") -> Title:
    """Understand a title, with what stands below it in a row of units."""
    short = text[:_LONGEST_TITLE]
    unit, unknown = _unit_in(short)
    if unit_below.strip() and not _MULTIPLE.search(short):
        below = spelt(unit_below)
        if dimension_of(below) is None:
            unknown = unknown or below
        elif unit is not None and unit != below:
            unit, unknown = None, f"{unit} and {below}"
        else:
            unit, unknown = below, None
    quantity = _quantity_of(short)
    if quantity is not None and unit is not None:
        dimension = dimension_of(unit)
        quantity = _BY_UNIT.get((quantity, dimension), quantity) if dimension else quantity
    elif quantity is None and unit is not None and mode_in(short) and dimension_of(unit) == "stress":
        quantity = "stress"  # as "Druck (kPa)"
    return Title(
        text=text.strip(),
        quantity=quantity,
        unit=unit,
        unknown_unit=unknown,
        measure=_measure_in(short, quantity),
        nominal=has_word(short, NOMINAL_WORDS),
        mode=mode_in(short),
    )


def mode_in(text: str) -> Mode | None:
    """Return the mode of loading whose words stand in a text; None where none or both do."""
    pushed, pulled = (has_word(text, MODE_WORDS[mode]) for mode in ("compression", "tension"))
    if pushed == pulled:
        return None
    return "compression" if pushed else "tension"


def _measure_in(text: str, quantity: Quantity | None) -> Measure | None:
    if quantity is None or quantity not in MEASURE_WORDS or has_word(text, NOMINAL_WORDS):
        return None
    return next(
        (measure for measure, words in MEASURE_WORDS[quantity].items() if has_word(text, words)), None
    )


def _quantity_of(text: str) -> Quantity | None:
    outside = _BRACKETS.sub(" ", text)
    for said in (outside, text):
        for quantity, words in COLUMN_WORDS.items():
            if has_word(said, words):
                return quantity
    return None


def _unit_in(text: str) -> tuple[str | None, str | None]:
    """Return the unit in a title, and what stands in brackets and could be an unknown one."""
    multiple = _MULTIPLE.search(text)
    if multiple:
        return None, multiple[0]  # which way it is meant, nobody can tell
    inner = [spelt(found) for found in _BRACKETS.findall(text)]
    known = [unit for unit in inner if dimension_of(unit) is not None]
    if known:
        return known[-1], None
    if _PER_LENGTH.search(text):
        return "mm/mm", None
    behind = _BEHIND.match(_BRACKETS.sub(" ", text).strip())
    # a bare 1 or - behind a name is a number or a dash, not a unit
    if behind and spelt(behind[2]) not in ("1", "-") and _is_unit(spelt(behind[2])):
        return spelt(behind[2]), None
    unknown = [
        found
        for found in inner
        if found and len(found) <= _LONGEST_UNIT and not found.isdigit() and _quantity_of(found) is None
    ]
    return None, unknown[0] if unknown else None


def _is_unit(text: str) -> bool:
    return any(text in units for units in UNITS.values())
