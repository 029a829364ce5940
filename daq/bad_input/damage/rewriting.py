"""Changes to an export that leave its meaning, or leave it open: whoever reads it has the right value, or refuses."""

from collections.abc import Sequence
from random import Random

from daq.bad_input.damage.any_file import (
    Damage,
    as_utf16,
    doubled,
    in_latin_1,
    with_byte_order_mark,
    with_carriage_returns,
    with_line_twice,
    without_line,
)


def columns_parted_otherwise(random: Random, content: bytes) -> bytes:
    """Tabs have become something else, among it the decimal mark."""
    return content.replace(b"\t", random.choice((b";", b",", b"|", b"  ", b" ; ")))


def decimal_points(random: Random, content: bytes) -> bytes:
    """Decimal commas have become points, in all lines or from some line on."""
    lines = content.splitlines(keepends=True)
    begin = random.choice((0, 0, random.randrange(len(lines))))
    return b"".join([*lines[:begin], *(line.replace(b",", b".") for line in lines[begin:])])


def units_removed(random: Random, content: bytes) -> bytes:
    """The row of units is missing, or a unit in it, or that of a size."""
    lines = content.splitlines(keepends=True)
    units = next(i for i, line in enumerate(lines) if line.startswith(b"s\t"))
    which = random.randrange(4)
    if which == 0:
        del lines[units]
    elif which == 1:
        lines[units] = lines[units].replace(b"%", b"")
    elif which == 2:
        lines[units] = lines[units].replace(b"N", b"")
    else:
        lines = [line.replace(b"\tmm", b"", 1) for line in lines]
    return b"".join(lines)


def quoted(_random: Random, content: bytes) -> bytes:
    """Every field stands in quotes."""
    return b"\n".join(
        b"\t".join(b'"%s"' % field for field in line.split(b"\t")) if line else b""
        for line in content.split(b"\n")
    )


def fields_added(random: Random, content: bytes) -> bytes:
    """A row has more fields than there are names, or fewer."""
    lines = content.splitlines()
    place = random.randrange(len(lines) // 2, len(lines))
    lines[place] = random.choice(
        (lines[place] + b"\t1,0", lines[place].rpartition(b"\t")[0], b"1,0\t" + lines[place])
    )
    return b"\n".join([*lines, b""])


def rows_backwards(_random: Random, content: bytes) -> bytes:
    """The rows of the table run from the last to the first."""
    lines = content.splitlines()
    begin = 1 + next(i for i, line in enumerate(lines) if line.startswith(b"s\t"))
    return b"\n".join([*lines[:begin], *reversed(lines[begin:]), b""])


def zero_rows_first(_random: Random, content: bytes) -> bytes:
    """The machine recorded before it moved."""
    lines = content.splitlines()
    begin = 1 + next(i for i, line in enumerate(lines) if line.startswith(b"s\t"))
    return b"\n".join([*lines[:begin], *[lines[begin]] * 30, *lines[begin:], b""])


REWRITTEN: Sequence[Damage] = (
    as_utf16,
    in_latin_1,
    with_byte_order_mark,
    with_carriage_returns,
    doubled,
    without_line,
    with_line_twice,
    *(columns_parted_otherwise,) * 3,
    *(decimal_points,) * 3,
    *(units_removed,) * 3,
    quoted,
    *(fields_added,) * 2,
    rows_backwards,
    zero_rows_first,
)
