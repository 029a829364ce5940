"""Command-line options from the fields of a settings dataclass, so that each setting is described in one place.

The help text of an option is the description of the field under ``Attributes`` in the class' docstring.
"""

import argparse
import dataclasses
import inspect
import re
import types
from collections.abc import Callable, Mapping
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

T = TypeVar("T")

_FIELD = re.compile(r"^ {4}(\w+(?:, \w+)*) : (.*)$")


def add_options(
    parser: argparse.ArgumentParser, title: str, kind: type[Any], flags: Mapping[str, str] | None = None
) -> None:
    """Add an option for every field of plain type: numbers, text, truth values, choices, tuples of numbers.

    Parameters
    ----------
    title : of the group in the help text
    flags : names of options that differ from those of their fields
    """
    group = parser.add_argument_group(title)
    descriptions = _descriptions(kind)
    for field, arguments in _plain_fields(kind):
        default = _default(field)
        told = descriptions.get(field.name, "").replace("%", "%%")
        group.add_argument(
            (flags or {}).get(field.name) or f"--{field.name.replace('_', '-')}",
            dest=f"{kind.__name__}.{field.name}",
            default=default,
            help=f"{told} (default: {_shown(default)})" if told else f"default: {_shown(default)}",
            **arguments,
        )


def read_options(options: argparse.Namespace, kind: type[T], **others: object) -> T:
    """Make the dataclass from parsed options; ``others`` are its fields that are no options."""
    values = {
        field.name: getattr(options, f"{kind.__name__}.{field.name}") for field, _ in _plain_fields(kind)
    }
    return kind(**{name: _frozen(value) for name, value in values.items()}, **others)


def _plain_fields(kind: type[Any]) -> list[tuple["dataclasses.Field[Any]", dict[str, Any]]]:
    hints = get_type_hints(kind)
    fields = [(field, _arguments(hints[field.name])) for field in dataclasses.fields(kind)]
    return [(field, arguments) for field, arguments in fields if arguments is not None]


def _arguments(hint: Any) -> dict[str, Any] | None:
    """Return what argparse needs for a type; None where it has no form on a command line."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        plain = [kind for kind in inner if kind is not types.NoneType]
        return _arguments(plain[0]) if len(plain) == 1 else None
    if origin is Literal:
        return {"choices": inner, "type": type(inner[0])}
    if origin is tuple and all(kind in (int, float) for kind in inner if kind is not Ellipsis):
        return {
            "type": _number(inner[0]),
            "nargs": "*" if inner[-1] is Ellipsis else len(inner),
            "metavar": "N",
        }
    if hint is bool:
        return {"action": argparse.BooleanOptionalAction}
    if hint in (int, float):
        return {"type": _number(hint), "metavar": "N"}
    return {"type": str, "metavar": "TEXT"} if hint is str else None


def _number(kind: type[int] | type[float]) -> Callable[[str], int | float]:
    def number(text: str) -> int | float:
        return int(text, 0) if kind is int else float(text)

    number.__name__ = (
        "whole number" if kind is int else "number"
    )  # argparse tells this name in its complaints
    return number


def _default(field: "dataclasses.Field[Any]") -> object:
    if field.default is not dataclasses.MISSING:
        return field.default
    return None if field.default_factory is dataclasses.MISSING else field.default_factory()


def _shown(default: object) -> str:
    if isinstance(default, tuple):
        return " ".join(f"{value:g}" for value in default) or "none"
    if default == float("inf"):
        return "never"
    return "none" if default in (None, "") else str(default)


def _frozen(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


def _descriptions(kind: type[Any]) -> dict[str, str]:
    """Return the descriptions of the attributes in a docstring of numpy's style."""
    descriptions: dict[str, str] = {}
    names: list[str] = []
    for line in ("    " + line for line in inspect.cleandoc(kind.__doc__ or "").splitlines()):
        if found := _FIELD.match(line):
            names = found[1].split(", ")
            descriptions |= dict.fromkeys(names, found[2])
        elif names and line.startswith(" " * 8):
            descriptions |= {name: f"{descriptions[name]} {line.strip()}" for name in names}
        else:
            names = []
    return descriptions
