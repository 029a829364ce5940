"""Units as files and users spell them, and quantities of a number and a unit."""

import re

from estimator.errors import InputError
from estimator.input_file import parse_number
from estimator.uniaxial.reading.language.vocabulary import UNITS, Dimension

_BRACKETED = re.compile(r"^\s*[(\[{<]\s*(.*?)\s*[)\]}>]\s*$")
_SQUARE = re.compile(
    r"^sq(?:uare)?[.\s]\s*(in)(?:ch|ches)?\.?$|^sq(?:uare)?[.\s]\s*([cmµ]?m)$", re.IGNORECASE
)
_QUANTITY = re.compile(r"\s*([+-]?[\d.,]+(?:[eE][+-]?\d+)?)\s*(\S.*?)?\s*")


def spelt(text: str) -> str:
    """Return a unit in the spelling of the vocabulary, without brackets: ``[N/mm²]`` is ``N/mm2``."""
    inner = _BRACKETED.match(text)
    bare = inner[1] if inner else text.strip()
    bare = bare.replace("²", "2").replace("^2", "2").replace("**2", "2").replace("\u03bc", "µ")
    bare = _SQUARE.sub(r"\1\g<2>2", bare)
    name = re.sub(r"\s+", "", bare).removesuffix(".")
    return (
        name if any(name in units for units in UNITS.values()) else _OTHER_CASE.get(_without_case(name), name)
    )


def _without_case(name: str) -> str:
    """Return a unit without case, but for a first letter that may be a prefix or a unit: ``mN`` is no ``MN``."""
    return name[:1] + name[1:].casefold() if name[:1] in "mMnN" else name.casefold()


def _unique_without_case() -> dict[str, str]:
    """Return the units by their spelling without case, where only one dimension and factor has it."""
    found: dict[str, list[tuple[Dimension, float, str]]] = {}
    for dimension, units in UNITS.items():
        for unit, factor in units.items():
            found.setdefault(_without_case(unit), []).append((dimension, factor, unit))
    return {key: each[0][2] for key, each in found.items() if len({one[:2] for one in each}) == 1}


_OTHER_CASE = _unique_without_case()


def dimension_of(unit: str) -> Dimension | None:
    """Return what a unit measures, None where it is unknown or what stands there is no unit."""
    name = spelt(unit)
    return next((dimension for dimension, units in UNITS.items() if name in units), None)


def factor_of(unit: str, dimension: Dimension, where: str) -> float:
    """Return the factor to SI.

    Raises
    ------
    InputError
        The unit is none of this dimension.
    """
    name = spelt(unit)
    if name not in UNITS[dimension]:
        raise InputError(f"{where}: {unit.strip()!r} is no unit of {dimension}; write {shown(dimension)}")
    return UNITS[dimension][name]


def shown(dimension: Dimension) -> str:
    """Return the usual units of a dimension, for a message."""
    spellings: dict[float, str] = {}
    for unit, factor in UNITS[dimension].items():
        spellings.setdefault(factor, unit)
    return ", ".join(spellings.values())


def stated_quantity(text: str, dimension: Dimension, option: str) -> float:
    """Return the value in SI of a quantity that a user states, as in ``20 mm``.

    Raises
    ------
    InputError
        There is no unit, or no positive number.
    """
    match = _QUANTITY.fullmatch(text)
    try:
        number = parse_number(match[1].replace(",", ".")) if match else float("nan")
    except ValueError:
        number = float("nan")
    if match is None or not 0 < number < float("inf"):
        wanted = f"'20 {_usual(dimension)}'"
        raise InputError(f"{option} {text!r}: is no positive number with a unit; write it as in {wanted}")
    if not match[2]:
        raise InputError(f"{option} {text!r}: has no unit; write it as in '{match[1]} {_usual(dimension)}'")
    return number * factor_of(match[2], dimension, f"{option} {text!r}")


def _usual(dimension: Dimension) -> str:
    return next(iter(UNITS[dimension]))
