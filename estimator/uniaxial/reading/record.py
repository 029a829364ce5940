"""Reads the record of a test from a file: text of any usual layout or a spreadsheet, to strain and stress in SI."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from estimator.errors import InputError
from estimator.uniaxial.course import Course, course_of, without_preload
from estimator.uniaxial.reading.cells.grid import Grid, Row
from estimator.uniaxial.reading.cells.spreadsheet import is_spreadsheet, read_spreadsheet
from estimator.uniaxial.reading.cells.text_layout import read_text_layout
from estimator.uniaxial.reading.facts import facts_of, mode_of_facts, sizes_of
from estimator.uniaxial.reading.language.titles import Title, mode_in
from estimator.uniaxial.reading.language.vocabulary import LENGTHENING_WORDS
from estimator.uniaxial.reading.language.words import has_word, words_of
from estimator.uniaxial.reading.mode import Evidence, decide_mode
from estimator.uniaxial.reading.other_tests import ToldOtherwise, other_test, refuse_other_test
from estimator.uniaxial.reading.specimen import Specimen
from estimator.uniaxial.reading.stated import NOTHING_STATED, Stated
from estimator.uniaxial.reading.tables.blocks import (
    FEWEST_ROWS,
    Block,
    chosen_block,
    find_blocks,
    listed,
    unknown_names,
)
from estimator.uniaxial.reading.tables.choosing import ABSCISSAE, ORDINATES, choose
from estimator.uniaxial.reading.tables.columns import Table, table_of
from estimator.uniaxial.reading.tables.curve import LARGEST_STRAIN, Curve, curve_of
from estimator.uniaxial.records import DEFAULT_STRAIN_FIT, Mode, UniaxialRecord

_READ_ELSEWHERE = " (`retract diagnose` reads simple shear)"
_SHORT_LINE = 4
_MODULUS_RANGE = (100.0, 1e9)  # Pa, secant at the largest strain: jelly to hard plastic


@dataclass(frozen=True, slots=True, eq=False)
class Opened:
    """The table of a specimen as it was found: all of its rows, and what stands around them."""

    file: Path
    blocks: Sequence[Block]
    block: Block
    place: int
    table: Table
    above: Sequence[Row]
    specimen: Specimen
    curve: Curve

    @property
    def found(self) -> tuple[str, ...]:
        """What was read from where, a sentence each."""
        others = (
            (f"specimen {self.place + 1} of {listed(self.blocks)}; --specimen takes another",)
            if len(self.blocks) > 1
            else ()
        )
        return (*others, f"{self.block.grid.how}, decimal {self.table.style.mark}", *self.curve.found)


def opened(path: Path | str, stated: Stated) -> Opened:
    """Read strain and stress of all rows.

    Raises
    ------
    InputError
        The file is missing or no such table, a field is no number, or a unit or a size is stated nowhere.
    """
    file = Path(path)
    grids = read_spreadsheet(file) if is_spreadsheet(file) else [read_text_layout(file)]
    blocks = find_blocks(grids)
    if not blocks:
        names = unknown_names(grids)
        if names:
            raise InputError(
                f"{names}, of which none is known as strain, travel or height, or none as stress or load; "
                "name them so, with their units, as in 'strain (-)' and 'stress (kPa)'"
            )
        raise InputError(
            f"{file}: no line names a strain and a stress column, or a load and a travel, above rows of numbers; "
            "write 'strain (-),stress (kPa)' above the table"
        )
    block, place = chosen_block(blocks, stated.specimen, str(file))
    table = table_of(block, [choose(block, kinds).column for kinds in (ABSCISSAE, ORDINATES)], stated)
    if len(table.rows) < FEWEST_ROWS:
        raise InputError(f"{file}: {len(table.rows)} rows; at least {FEWEST_ROWS} are needed")
    above = _rows_above(grids, blocks, block)
    columns = range(min(block.titles), max(block.titles) + 1)
    specimen = Specimen(stated, sizes_of(block.grid, above, table.style, place, columns))
    curve = curve_of(table, specimen)
    return Opened(file, blocks, block, place, table, above, specimen, curve)


def read_record(path: Path | str, stated: Stated = NOTHING_STATED) -> UniaxialRecord:
    """Read the first loading of a test.

    Parameters
    ----------
    stated : the user's word on what the file leaves open

    Raises
    ------
    InputError
        The file is missing or no such table, a field is no number, a unit or a size or the mode is stated nowhere, or
        the values cannot be stress and strain.
    """
    read = opened(path, stated)
    file, curve = read.file, read.curve
    refuse_other_test(other_test_in(read, stated), str(file), _READ_ELSEWHERE)
    _check_strain(file, curve)
    course = course_of(
        curve.strain,
        curve.stress,
        curve.lines,
        curve.time,
        keep_zero=stated.keep_zero,
        over_first=curve.over_first,
    )
    if len(course.strain) < FEWEST_ROWS:
        raise InputError(_too_short(file, course))
    decision = decide_mode(evidence_of(read, stated, course), str(file))
    if not stated.keep_zero:
        course = without_preload(course, decision.mode, DEFAULT_STRAIN_FIT[decision.mode])
    _check_stiffness(file, course)
    facts = facts_of(read.above)
    sign = 1.0 if decision.mode == "tension" else -1.0
    supposed = (f"{decision.mode}, from {decision.reason}",) if decision.supposed else ()
    return UniaxialRecord(
        name=file.stem,
        mode=decision.mode,
        strain=sign * course.strain,
        stress=sign * course.stress,
        facts=facts,
        path=file,
        shape_factor=read.specimen.shape_factor,
        strain_from_crosshead=curve.from_crosshead
        or any("crosshead" in told.lower() for told in facts.values()),
        mode_from=decision.reason,
        found=read.found,
        assumed=(*curve.assumed, *supposed, *course.assumed),
        left_out=(*read.table.left_out, *course.left_out),
    )


def _rows_above(grids: Sequence[Grid], blocks: Sequence[Block], block: Block) -> list[Row]:
    """Return the rows that state facts of a block: those above it, above the first, and sheets without a table."""
    with_table = {each.grid.name for each in blocks}
    first = next(each for each in blocks if each.grid is block.grid)
    rows = list(block.above)
    if first.header_line != block.header_line:
        rows = [*rows, *first.above]
    for grid in grids:
        if grid.name not in with_table:
            rows = [*rows, Row(0, ()), *grid.rows]
    return rows


def other_test_in(read: Opened, stated: Stated) -> ToldOtherwise | None:
    """Return what tells that a test neither pulls nor pushes; a stated mode outranks all but the columns' titles."""
    titles = [read.curve.abscissa.title.text, read.curve.ordinate.title.text]
    return (
        other_test(titles, read.above, read.file.stem) if stated.mode is None else other_test(titles, (), "")
    )


def evidence_of(read: Opened, stated: Stated, course: Course) -> Evidence:
    """Return what tells the mode of a test."""
    block, above, curve = read.block, read.above, read.curve
    used = [curve.abscissa.title, curve.ordinate.title]
    titles = [*used, *(title for title in block.titles.values() if title not in used)]
    lengthening = has_word(curve.abscissa.title.text, LENGTHENING_WORDS)
    return Evidence(
        stated=stated.mode,
        in_titles=_mode_of_titles(titles),
        in_facts=mode_of_facts(above),
        height_grows=curve.height_grows,
        strain_sign=course.strain_sign,
        stress_sign=course.stress_sign,
        lengthening=curve.abscissa.title.text if lengthening else "",
        in_names=_mode_of_names(read.file.stem, block, above),
        strain=course.strain,
        stress=course.stress,
    )


def _mode_of_titles(titles: Sequence[Title]) -> tuple[Mode, str] | None:
    """Return the mode that titles say, those of the columns used before others; None where they contradict."""
    told = {title.mode: title.text for title in reversed(titles) if title.mode is not None}
    if len(told) > 1:
        told = {title.mode: title.text for title in titles[:2] if title.mode is not None}
    mode, text = next(iter(told.items())) if len(told) == 1 else (None, "")
    return None if mode is None else (mode, text)


def _mode_of_names(name: str, block: Block, above: Sequence[Row]) -> tuple[Mode, str] | None:
    """Return the mode that the names of file, sheet and specimen say, or a short line of words; None if not one."""
    lines = [
        row.filled[0] for row in above if len(row.filled) == 1 and len(words_of(row.filled[0])) <= _SHORT_LINE
    ]
    told = {mode: text for text in (*lines, block.grid.name, block.label, name) if (mode := mode_in(text))}
    return next(iter(told.items())) if len(told) == 1 else None


def _check_strain(file: Path, curve: Curve) -> None:
    largest = float(np.abs(curve.strain).max())
    if largest > LARGEST_STRAIN:
        raise InputError(
            f"{file}: strain from {curve.abscissa.title.text!r} reaches {largest:.3g} times the length, more than any "
            "material bears; check its unit and the gauge length"
        )
    if np.ptp(curve.strain) == 0 or np.ptp(curve.stress) == 0:
        raise InputError(f"{file}: strain or stress does not change; check which columns hold them")


def _too_short(file: Path, course: Course) -> str:
    why = f" ({'; '.join(course.left_out)})" if course.left_out else ""
    return (
        f"{file}: the first loading has {len(course.strain)} rows of at least {FEWEST_ROWS}{why}; "
        "cut the file to the loading that you mean"
    )


def _check_stiffness(file: Path, course: Course) -> None:
    low, high = _MODULUS_RANGE
    end = int(np.argmax(course.strain))
    secant = float(course.stress[end] / course.strain[end]) if course.strain[end] > 0 else 0.0
    if not low <= secant <= high:
        raise InputError(
            f"{file}: stress over strain is {secant:.3g} Pa at a strain of {course.strain[end]:.3g}, and a solid's is "
            f"{low:g} to {high:g}; check the units and sizes"
        )
