"""The unit of a column: the file's, else the user's; an unknown or contradictory one is refused."""

from estimator.errors import InputError
from estimator.uniaxial.reading.language.units import factor_of, shown
from estimator.uniaxial.reading.language.vocabulary import DIMENSION_OF, Dimension
from estimator.uniaxial.reading.stated import Stated
from estimator.uniaxial.reading.tables.choosing import Choice
from estimator.uniaxial.reading.tables.columns import Table

_OPTIONS: dict[Dimension, str] = {
    "strain": "--strain-unit",
    "stress": "--stress-unit",
    "force": "--force-unit",
    "length": "--length-unit",
}
_USUAL: dict[Dimension, str] = {
    "strain": "% or -",
    "stress": "kPa, MPa or Pa",
    "force": "N or mN",
    "length": "mm",
}


def header_of(table: Table) -> str:
    """Return how a message names the line of the titles."""
    return table.block.grid.place(table.block.header_line)


def unit_of(table: Table, choice: Choice, stated: Stated) -> str | None:
    """Return the unit that the file states, else the user; None where neither does.

    Raises
    ------
    InputError
        It is unknown or measures something else, or the two differ.
    """
    title, dimension = choice.title, DIMENSION_OF[choice.quantity]
    option = _OPTIONS[dimension]
    asked = _asked(stated, dimension)
    if title.unknown_unit is not None and asked is None:
        raise InputError(
            f"{header_of(table)}: the unit of {title.text!r} ({title.unknown_unit}) is none of {shown(dimension)}; "
            f"convert it, or add {option}"
        )
    # behind every number it outranks the name
    unit = "%" if dimension == "strain" and table.in_percent(choice.column) else title.unit
    if unit is None:
        if asked is not None:
            factor_of(asked, dimension, option)
        return asked
    factor = factor_of(unit, dimension, f"{header_of(table)}, {title.text!r}")
    if asked is not None and factor_of(asked, dimension, option) != factor:
        raise InputError(
            f"{header_of(table)}: {title.text!r} is in {unit}, and {option} says {asked}; "
            "leave the option out, or correct the file"
        )
    return unit


def required_factor(table: Table, choice: Choice, stated: Stated) -> tuple[float, str]:
    """Return the factor to SI and the unit.

    Raises
    ------
    InputError
        As :func:`unit_of`, or there is none.
    """
    unit = unit_of(table, choice, stated)
    if unit is None:
        raise InputError(missing_unit(table, choice))
    return factor_of(unit, DIMENSION_OF[choice.quantity], choice.title.text), unit


def missing_unit(table: Table, choice: Choice, more: str = "") -> str:
    """Return the message that asks for a unit."""
    dimension = DIMENSION_OF[choice.quantity]
    return (
        f"{header_of(table)}: {choice.title.text!r} has no unit{more}; "
        f"add {_OPTIONS[dimension]} with it ({_USUAL[dimension]})"
    )


def _asked(stated: Stated, dimension: Dimension) -> str | None:
    return {
        "strain": stated.strain_unit,
        "stress": stated.stress_unit,
        "force": stated.force_unit,
        "length": stated.length_unit,
    }.get(dimension)
