"""Damage to single values of TOML, JSON and tables: wrong types, impossible numbers, names that lead elsewhere."""

import json
import re
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from random import Random
from typing import Any

from daq.bad_input.damage.any_file import Damage

CANARY = "executed-by-bad-input"
"""Name of the file that appears where something in an input was executed, or a path in it was followed."""

_ELSEWHERE = str(Path(tempfile.gettempdir()) / CANARY).replace("\\", "/")
_TOML_VALUE = re.compile(rb"(?m)(?<=[=\[,] )(\"[^\"\n]*\"|-?[0-9][0-9.eE+-]*|true|false)")
_JSON_VALUE = re.compile(rb"(?<=[:\[,] )(\"[^\"\n]*\"|-?[0-9][0-9.eE+-]*|true|false|null)")
_KEY = re.compile(rb"(?m)^([A-Za-z_]+)(?= = )")
_JSON_KEY = re.compile(rb"\"([^\"\n]+)\"(?=: )")

_NUMBERS = (
    b"nan", b"inf", b"-inf", b"1e308", b"-1e308", b"1e400", b"1e-320", b"0", b"-0.0", b"-1", b"-7.5", b"0.5",
    b"1000000000", b"9223372036854775808", b"1" + b"0" * 400, b"9" * 5000, b"0x7fffffffffffffff", b"1_0",
)  # fmt: skip
_NAMES = (
    "", " ", ".", "..", f"../{CANARY}", f"../../{CANARY}", _ELSEWHERE, "/dev/zero", "CON", "aux.txt", "a/b", "a\\\\b",
    "x\\u0000y", "x\\ny", "{date.__class__}", "{trial:999999999d}", "{}", "%s%n", "<script>alert(1)</script>",
    f"=cmd|' /C touch {CANARY}'!A0", f"$(touch {CANARY})", f"; touch {CANARY}", f"{CANARY}.py:run", "é" * 300,
    "n" * 100_000, f"../{CANARY}.py:run",
)  # fmt: skip
_TYPES = (
    b"true",
    b"[]",
    b"{}",
    b"[[]]",
    b"[1, 2, 3]",
    b'""',
    b'["a"]',
    b"[" * 3000,
    b"1979-05-27",
    b"07:32:00",
)
_MISSING_SHARE = 0.25
_CELLS = (
    b"", b" ", b"nan", b"NaN", b"inf", b"-Infinity", b"1e400", b"1e308", b"-1e308", b"0", b"-1", b"1,5", b"x",
    b"0x10", b"1_0", b"9" * 5000, b'"', b'"a\nb"', b"=1+1", b"\xc2\xb2", b"\xd9\xa3", b"99999999999999999999",
    b"12 N", b"--", b"1e", b"None", b"hold", b"ramp",
)  # fmt: skip


def _toml_name(name: str) -> bytes:
    return f'"{name}"'.encode()


def toml_value_replaced(random: Random, content: bytes) -> bytes:
    """A value of a TOML file is another."""
    return _replaced(
        random, content, _TOML_VALUE, random.choice((*_NUMBERS, *map(_toml_name, _NAMES), *_TYPES))
    )


def toml_value_of_its_type_replaced(random: Random, content: bytes) -> bytes:
    """A number of a TOML file is another, or a text is another."""
    found = random.choice(list(_TOML_VALUE.finditer(content)))
    others: Sequence[bytes] = [_toml_name(name) for name in _NAMES] if found[0].startswith(b'"') else _NUMBERS
    return content[: found.start()] + random.choice(others) + content[found.end() :]


def toml_key_misspelt(random: Random, content: bytes) -> bytes:
    """A key of a TOML file is another."""
    return _replaced(random, content, _KEY, random.choice((b"speed", b"a.b.c", b'""', b"1", b"key", b"path")))


def json_value_replaced(random: Random, content: bytes) -> bytes:
    """A value of a JSON file is another."""
    numbers = [number for number in _NUMBERS if number not in (b"nan", b"inf", b"-inf")]
    others = (
        *numbers,
        b"NaN",
        b"Infinity",
        *map(_toml_name, _NAMES),
        b"null",
        b"true",
        b"[]",
        b"{}",
        b"[" * 3000,
    )
    return _replaced(random, content, _JSON_VALUE, random.choice(others))


def json_key_misspelt(random: Random, content: bytes) -> bytes:
    """A key of a JSON file is another, or one that stands there already."""
    return _replaced(random, content, _JSON_KEY, random.choice((b'"key"', b'""', b'"value"', b'"name"')))


def json_part_replaced(random: Random, content: bytes) -> bytes:
    """A part of a JSON file, a value or a whole table, is another or missing."""
    whole = json.loads(content)
    tables = list(_tables_in(whole))
    table = random.choice(tables)
    key = random.choice(list(table) if isinstance(table, dict) else range(len(table)))
    part: Any = random.choice(
        (None, True, 3, -1.5, "text", [], {}, [[]], ["a"], [1, 2, 3], {"a": 1}, {"a": {}})
    )
    if random.random() < _MISSING_SHARE:
        del table[key]
    else:
        table[key] = part
    return json.dumps(whole, indent=1).encode()


def json_line_replaced(random: Random, content: bytes) -> bytes:
    """A part of a line of a file of JSON lines is another or missing."""
    lines = content.splitlines()
    place = random.randrange(len(lines))
    lines[place] = json.dumps(json.loads(json_part_replaced(random, lines[place]))).encode()
    return b"\n".join([*lines, b""])


def toml_table_replaced(random: Random, content: bytes) -> bytes:
    """A table of a TOML file is a value, or a list of tables, or one of another name."""
    headers = list(re.finditer(rb"(?m)^\[([A-Za-z_.]+)\]$", content))
    if not headers:
        return toml_key_misspelt(random, content)
    found = random.choice(headers)
    others = (b"[[%s]]" % found[1], b"[other]", b"%s = 3\n[other]" % found[1].rpartition(b".")[2], b"")
    return content[: found.start()] + random.choice(others) + content[found.end() :]


def _tables_in(value: object) -> Iterator[Any]:
    """Yield every table and every list in a value of JSON that has something in it."""
    if isinstance(value, dict | list) and value:
        yield value
        for inner in value.values() if isinstance(value, dict) else value:
            yield from _tables_in(inner)


def cell_replaced(random: Random, content: bytes) -> bytes:
    """A field of a table is another."""
    lines = content.splitlines(keepends=True)
    place = random.randrange(len(lines))
    fields = lines[place].rstrip(b"\r\n").split(b",")
    for _ in range(random.choice((1, 1, 3))):
        fields[random.randrange(len(fields))] = random.choice(_CELLS)
    lines[place] = b",".join(fields) + b"\n"
    return b"".join(lines)


def column_replaced(random: Random, content: bytes) -> bytes:
    """All fields of a column are one other value."""
    lines = content.splitlines()
    place, value = random.randrange(len(lines[0].split(b","))), random.choice(_CELLS)
    return b"\n".join([lines[0], *(_with_field(line, place, value) for line in lines[1:])]) + b"\n"


def column_removed(random: Random, content: bytes) -> bytes:
    """A column is missing."""
    place = random.randrange(len(content.splitlines()[0].split(b",")))
    return b"".join(
        b",".join(field for number, field in enumerate(line.split(b",")) if number != place) + b"\n"
        for line in content.splitlines()
    )


def separated_otherwise(random: Random, content: bytes) -> bytes:
    """Columns are separated by something else."""
    return content.replace(b",", random.choice((b";", b"\t", b" ", b"|", b",,")))


def _with_field(line: bytes, place: int, value: bytes) -> bytes:
    fields = line.split(b",")
    return b",".join([*fields[:place], value, *fields[place + 1 :]])


def _replaced(random: Random, content: bytes, what: re.Pattern[bytes], by: bytes) -> bytes:
    found = random.choice(list(what.finditer(content)))
    return content[: found.start()] + by + content[found.end() :]


TOML: Sequence[Damage] = (
    *(toml_value_replaced,) * 8,
    *(toml_value_of_its_type_replaced,) * 12,
    *(toml_key_misspelt,) * 2,
    *(toml_table_replaced,) * 3,
)
JSON: Sequence[Damage] = (
    *(json_value_replaced,) * 10,
    *(json_part_replaced,) * 10,
    *(json_key_misspelt,) * 3,
)
JSON_LINES: Sequence[Damage] = (
    *(json_value_replaced,) * 8,
    *(json_line_replaced,) * 8,
    *(json_key_misspelt,) * 3,
)
TABLE: Sequence[Damage] = (
    *(cell_replaced,) * 8,
    *(column_replaced,) * 4,
    column_removed,
    separated_otherwise,
)
