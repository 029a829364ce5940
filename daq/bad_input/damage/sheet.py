"""Damage to spreadsheets, within the archive that they are: cells that are others, parts that are broken or explode."""

import io
import re
import zipfile
from collections.abc import Callable, Sequence
from random import Random

import openpyxl

from daq.bad_input.damage.any_file import BINARY, Damage, overwritten

_SHEET = re.compile(r"xl/worksheets/sheet\d+\.xml")
_CELLS = (
    None, "", " ", "nan", "#DIV/0!", "x", True, 0, -1, 1e308, -1e308, 1e-320, "1,5", "1.234.567", "12 N", "=1+1",
    "(mm)", "9" * 5000, "\u0663", 10**300,
)  # fmt: skip
_FORMATS = ("General", "0.00%", "yyyy-mm-dd", "[h]:mm:ss", "@")
_ENTITIES = b"""<!DOCTYPE worksheet [<!ENTITY a "0000000000"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">
<!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;"><!ENTITY d "&c;&c;&c;&c;&c;&c;&c;&c;&c;&c;">
<!ENTITY e "&d;&d;&d;&d;&d;&d;&d;&d;&d;&d;"><!ENTITY h "&e;&e;&e;&e;&e;&e;&e;&e;&e;&e;">]>"""


def cell_of_sheet_replaced(random: Random, content: bytes) -> bytes:
    """A cell holds something else."""
    book = openpyxl.load_workbook(io.BytesIO(content))
    sheet = random.choice(book.worksheets)
    for _ in range(random.choice((1, 1, 3))):
        cell = sheet.cell(random.randrange(1, sheet.max_row + 1), random.randrange(1, sheet.max_column + 1))
        cell.value = random.choice(_CELLS)
    return _saved(book)


def format_of_column_replaced(random: Random, content: bytes) -> bytes:
    """A column is shown as a percentage, a date or a time."""
    book = openpyxl.load_workbook(io.BytesIO(content))
    sheet = random.choice(book.worksheets)
    column, shown = random.randrange(1, sheet.max_column + 1), random.choice(_FORMATS)
    for row in range(1, sheet.max_row + 1):
        sheet.cell(row, column).number_format = shown
    return _saved(book)


def row_or_column_of_sheet_removed(random: Random, content: bytes) -> bytes:
    """A row or a column is missing."""
    book = openpyxl.load_workbook(io.BytesIO(content))
    sheet = random.choice(book.worksheets)
    if random.random() < 0.5:
        sheet.delete_rows(random.randrange(1, sheet.max_row + 1))
    else:
        sheet.delete_cols(random.randrange(1, sheet.max_column + 1))
    return _saved(book)


def part_overwritten(random: Random, content: bytes) -> bytes:
    """Some bytes of a part are others, and the archive is whole."""
    name = random.choice(zipfile.ZipFile(io.BytesIO(content)).namelist())
    return _with_part(content, lambda part: part == name, lambda text: overwritten(random, text))


def part_removed(random: Random, content: bytes) -> bytes:
    """A part is missing."""
    name = random.choice(zipfile.ZipFile(io.BytesIO(content)).namelist())
    return _with_part(content, lambda part: part == name, lambda text: None)


def sheet_with_wrong_dimension(random: Random, content: bytes) -> bytes:
    """The size that a sheet tells of itself is another."""
    told = random.choice((b"A1", b"A1:B2", b"A1:XFD1048576", b"x", b""))
    return _with_part(
        content,
        lambda part: bool(_SHEET.fullmatch(part)),
        lambda text: re.sub(rb'<dimension ref="[^"]*"', b'<dimension ref="%s"' % told, text),
    )


def sheet_with_exploding_entities(_random: Random, content: bytes) -> bytes:
    """A sheet with an entity that stands for a million digits."""
    return _with_part(
        content,
        lambda part: bool(_SHEET.fullmatch(part)),
        lambda text: _ENTITIES + text.partition(b"?>")[2].replace(b"<v>", b"<v>&h;", 1),
    )


def sheet_with_bomb(_random: Random, content: bytes) -> bytes:
    """A part that grows beyond what is unpacked."""
    return _with_part(content, lambda part: part == "xl/styles.xml", lambda text: text + bytes(310_000_000))


def _with_part(
    content: bytes, chosen: Callable[[str], bool], change: Callable[[bytes], bytes | None]
) -> bytes:
    stream = io.BytesIO()
    with (
        zipfile.ZipFile(io.BytesIO(content)) as given,
        zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as made,
    ):
        for name in given.namelist():
            text = change(given.read(name)) if chosen(name) else given.read(name)
            if text is not None:
                made.writestr(name, text)
    return stream.getvalue()


def _saved(book: openpyxl.Workbook) -> bytes:
    stream = io.BytesIO()
    book.save(stream)
    return stream.getvalue()


SHEETS: Sequence[Damage] = (
    *BINARY,
    *(cell_of_sheet_replaced,) * 8,
    *(format_of_column_replaced,) * 2,
    *(row_or_column_of_sheet_removed,) * 3,
    *(part_overwritten,) * 6,
    part_removed,
    sheet_with_wrong_dimension,
    sheet_with_exploding_entities,
    sheet_with_bomb,
)
