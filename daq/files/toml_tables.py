"""Typed TOML: frozen dataclasses from the tables of a file, and back.

A table becomes the dataclass of its type; an unknown key, a missing key, a wrong type or a refused value is told with
file and line. ``tomllib`` keeps no line numbers, so the line is looked up by the key when there is a complaint.
"""

import dataclasses
import json
import re
import types
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from daq.errors import RigError
from estimator.errors import InputError
from estimator.input_file import LARGEST_NUMBER, parse_toml, read_input_text

T = TypeVar("T")
Keys = tuple[str | int, ...]

# of what fits into 64 bits, with room to count on
_LARGEST_INTEGER = 2**62
_LONGEST_SHOWN = 60

_HEADER = re.compile(r"^\s*(\[\[?)\s*([A-Za-z0-9_.\-\"' ]+?)\s*\]\]?")
_ASSIGNMENT = re.compile(r"^\s*([A-Za-z0-9_.\-\"' ]+?)\s*=")


@dataclasses.dataclass(frozen=True, slots=True)
class TomlFile:
    """A parsed TOML file that knows the lines of its keys."""

    path: Path
    text: str
    root: dict[str, Any]

    @classmethod
    def read(cls, path: Path) -> "TomlFile":
        """Read and parse; raises RigError where there is no file or no TOML in it."""
        try:
            text = read_input_text(path)
            return cls(path, text, parse_toml(text, path))
        except InputError as error:
            raise RigError(str(error)) from error

    def mistake(self, keys: Keys, complaint: str, line_of: Keys | None = None) -> RigError:
        """Return the error for a value at ``keys``, with its line, or the one of a key within it."""
        name = ".".join(str(key) for key in keys) or "the file"
        return RigError(f"{self.path}, line {self._line(line_of or keys)}: {name} {complaint}")

    def build(self, kind: type[T], table: object, keys: Keys = ()) -> T:
        """Build a dataclass from a table found at ``keys``."""
        if not isinstance(table, Mapping):
            raise self.mistake(keys, f"must be a table, not {table!r}")
        fields = {field.name: field for field in dataclasses.fields(kind) if field.init}  # type: ignore[arg-type] # T is a dataclass
        hints = get_type_hints(kind)
        for key in table:
            if key not in fields:
                raise self.mistake((*keys, key), f"is no known key; allowed here: {', '.join(fields)}")
        for name, field in fields.items():
            required = field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
            if required and name not in table:
                raise self.mistake(keys, f"lacks the key {name}, {_wording(hints[name])}")
        values = {key: self.convert(hints[key], value, (*keys, key)) for key, value in table.items()}
        try:
            return kind(**values)
        except ValueError as error:
            named = [(*keys, key) for key in table if re.search(rf"\b{re.escape(key)}\b", str(error))]
            raise self.mistake(keys, f"is refused: {error}", line_of=next(iter(named), keys)) from error

    def convert(self, hint: Any, value: object, keys: Keys) -> Any:
        """Convert one TOML value to the type of a dataclass field."""
        origin, arguments = get_origin(hint), get_args(hint)
        if dataclasses.is_dataclass(hint) and isinstance(hint, type):
            return self.build(hint, value, keys)
        if origin in (Union, types.UnionType):
            return self.convert(next(kind for kind in arguments if kind is not types.NoneType), value, keys)
        if origin is Literal:
            if value not in arguments:
                raise self.mistake(
                    keys, f"must be one of {', '.join(map(repr, arguments))}, not {_shown(value)}"
                )
            return value
        if hint is object:
            return value
        if origin is tuple:
            return self._convert_tuple(arguments, value, keys)
        if hint is float and isinstance(value, int | float) and not isinstance(value, bool):
            if not abs(value) <= LARGEST_NUMBER:
                raise self.mistake(keys, f"must be finite, not {_shown(value)}")
            return float(value)
        if hint is Path and isinstance(value, str):
            if "\0" in value:
                raise self.mistake(keys, f"names no file: {_shown(value)}")
            return self.path.parent / value
        if hint is int and type(value) is int and abs(value) > _LARGEST_INTEGER:
            raise self.mistake(
                keys, f"must be at most {_LARGEST_INTEGER:g} in magnitude, not {_shown(value)}"
            )
        if hint in (str, bool, int) and type(value) is hint:
            return value
        raise self.mistake(keys, f"must be {_wording(hint)}, not {_shown(value)}")

    def _convert_tuple(self, kinds: tuple[Any, ...], value: object, keys: Keys) -> tuple[Any, ...]:
        if not isinstance(value, list):
            raise self.mistake(keys, f"must be a list, not {_shown(value)}")
        if kinds[-1] is Ellipsis:
            kinds = (kinds[0],) * len(value)
        if len(kinds) != len(value):
            raise self.mistake(keys, f"must have {len(kinds)} entries, not {len(value)}")
        return tuple(
            self.convert(kind, entry, (*keys, index))
            for index, (kind, entry) in enumerate(zip(kinds, value, strict=True))
        )

    def _line(self, keys: Keys) -> int:
        """Return the line of the key, or of the nearest table or key around it."""
        best_line, best_depth = 1, 0
        prefix: Keys = ()
        seen: dict[str, int] = {}
        for number, line in enumerate(self.text.splitlines(), start=1):
            if header := _HEADER.match(line):
                name = ".".join(_names(header[2]))
                if header[1] == "[[":
                    seen[name] = seen.get(name, -1) + 1
                here = prefix = _indexed(name, seen)
            elif assignment := _ASSIGNMENT.match(line):
                here = (*prefix, *_names(assignment[1]))
            else:
                continue
            if len(here) > best_depth and here == keys[: len(here)]:
                best_line, best_depth = number, len(here)
        return best_line


def _names(dotted: str) -> list[str]:
    """Return the parts of a dotted key, of which each may be quoted."""
    return [part.strip(" \"'") for part in dotted.split(".")]


def _shown(value: object) -> str:
    """Return a value as it was written, or its beginning."""
    if isinstance(value, int) and not isinstance(value, bool) and value.bit_length() > 200:
        return f"a number of {value.bit_length() // 3} digits"
    told = repr(value)
    return told if len(told) <= _LONGEST_SHOWN else f"{told[:_LONGEST_SHOWN]}..."


def _wording(hint: Any) -> str:
    """Say what a value must be, for a complaint."""
    origin, arguments = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        return " or ".join(_wording(kind) for kind in arguments if kind is not types.NoneType)
    if origin is Literal:
        return f"one of {', '.join(map(repr, arguments))}"
    if origin is tuple:
        count = "" if arguments[-1] is Ellipsis else f" of {len(arguments)} entries"
        return f"a list{count}, each {_wording(arguments[0])}"
    return "a table" if dataclasses.is_dataclass(hint) else f"of type {getattr(hint, '__name__', hint)}"


def _indexed(header: str, seen: Mapping[str, int]) -> Keys:
    """Return the keys of a table header, with the index of the present entry after each array of tables."""
    keys: list[str | int] = []
    parts = header.split(".")
    for depth, part in enumerate(parts, start=1):
        keys.append(part)
        array = ".".join(parts[:depth])
        if array in seen:
            keys.append(seen[array])
    return tuple(keys)


def toml_text(value: object, base: Path) -> str:
    """Write a dataclass as TOML; paths are written relative to ``base``. None is left out."""
    return "\n".join(_table_lines(value, (), base)) + "\n"


def _table_lines(table: object, names: tuple[str, ...], base: Path) -> list[str]:
    lines: list[str] = []
    nested: list[str] = []
    for field in dataclasses.fields(table):  # type: ignore[arg-type] # every table is a dataclass instance
        value = getattr(table, field.name)
        header = (*names, field.name)
        if value is None:
            continue
        if dataclasses.is_dataclass(value):
            nested += ["", f"[{'.'.join(header)}]", *_table_lines(value, header, base)]
        elif isinstance(value, tuple) and value and dataclasses.is_dataclass(value[0]):
            for entry in value:
                nested += ["", f"[[{'.'.join(header)}]]", *_table_lines(entry, header, base)]
        else:
            lines.append(f"{field.name} = {_literal(value, base)}")
    return lines + nested


def _literal(value: object, base: Path) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, Path):
        return _literal(str(value.relative_to(base)) if value.is_relative_to(base) else str(value), base)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, tuple):
        return f"[{', '.join(_literal(entry, base) for entry in value)}]"
    raise TypeError(f"no TOML form for {value!r}")
