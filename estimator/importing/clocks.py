"""One clock for all tables: the rows of one are kept, and the others are read between theirs."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from estimator.errors import InputError
from estimator.importing.mapping import Clock
from estimator.importing.table import FloatArray, Source, Table
from estimator.importing.units import factor_of


def times_of(source: Source, clocks: Sequence[Clock], file: Path) -> dict[str, FloatArray]:
    """Return the time of every row of each table, s, by the tables' names.

    Raises
    ------
    InputError
        A clock names no table or no column, a rate is not above zero, or time is not a number in every row.
    """
    times = {}
    for number, clock in enumerate(clocks, start=1):
        where = f"{file}: [[clock]] {number}"
        table = next((one for one in source.tables if one.name == clock.table), None)
        if table is None:
            names = ", ".join(one.name for one in source.tables)
            raise InputError(f"{where} table: there is no table {clock.table!r}; there is {names}")
        times[table.name] = _time(source, table, clock, where) + clock.offset_s
    return times


def at(
    wanted: FloatArray, source: Source, name: str, times: dict[str, FloatArray], base: Table, where: str
) -> FloatArray:
    """Return a column at the wanted times; its own rows where it is of the table that these are of.

    Another table's is read by a straight line between its rows; beyond its ends there is nothing.

    Raises
    ------
    InputError
        There is no such column, its table has no clock and another number of rows, or no moment in common.
    """
    table, column = source.find(name, where)
    if table.name == base.name:
        return column.values
    if table.name not in times:
        if table.rows == base.rows:
            return column.values
        raise InputError(
            f"{where}: the table {table.name!r} has no [[clock]]; add one, with its time or its rate"
        )
    own, values = times[table.name], column.values
    known = np.isfinite(values) & np.isfinite(own)
    if known.sum() < 2:
        return np.full(len(wanted), np.nan)
    order = np.argsort(own[known], kind="stable")
    first, last = own[known][order][[0, -1]]
    if not np.any((wanted >= first) & (wanted <= last)):
        raise InputError(
            f"{where}: the table {table.name!r} runs from {first:.6g} to {last:.6g} s and {base.name!r} "
            f"from {np.nanmin(wanted):.6g} to {np.nanmax(wanted):.6g} s, so that they have no moment in common; "
            "state offset_s of their [[clock]]"
        )
    return np.interp(wanted, own[known][order], values[known][order], left=np.nan, right=np.nan)


def _time(source: Source, table: Table, clock: Clock, where: str) -> FloatArray:
    if clock.time is not None:
        owner, column = source.find(clock.time.column, f"{where} time")
        if owner.rows != table.rows:
            raise InputError(
                f"{where} time: {clock.time.column!r} is of another table; name its rate instead"
            )
        seconds = column.values * factor_of(clock.time.unit, "time", f"{where} time")
        if not np.isfinite(seconds).all():
            row = int(np.argmax(~np.isfinite(seconds))) + 1
            raise InputError(
                f"{where} time: row {row} of {clock.time.column!r} has none; complete or delete the row"
            )
        return np.asarray(seconds)
    if clock.rate_hz is None or not clock.rate_hz > 0:
        raise InputError(f"{where}: neither time nor a rate above zero; state one of them")
    return np.arange(table.rows) / clock.rate_hz
