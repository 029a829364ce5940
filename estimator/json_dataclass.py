"""Dataclasses from the objects of a JSON file that somebody may have damaged: every entry there, and of its type."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from estimator.input_file import LARGEST_NUMBER

T = TypeVar("T")


def from_json(kind: type[T], told: object) -> T:
    """Return a dataclass from what :func:`dataclasses.asdict` and JSON made of it.

    Parameters
    ----------
    kind : a dataclass of numbers, texts, choices of texts, and sequences and mappings of them

    Raises
    ------
    ValueError
        An entry is missing, unknown or of another type, or the dataclass refuses them together.
    """
    hints = {field.name: get_type_hints(kind)[field.name] for field in dataclasses.fields(kind)}  # type: ignore[arg-type] # T is a dataclass
    if not isinstance(told, dict) or told.keys() != hints.keys():
        raise ValueError(f"has not the entries {', '.join(hints)}")
    for name, hint in hints.items():
        if not _is_of(told[name], hint):
            raise ValueError(f"{name} cannot be {str(told[name])[:40]!r}")
    return kind(**{name: _typed(told[name], hint) for name, hint in hints.items()})


def _is_of(value: object, hint: Any) -> bool:
    """Tell whether a value of JSON can be one of a type."""
    of = get_args(hint)
    if get_origin(hint) is Literal:
        return isinstance(value, str) and value in of
    if get_origin(hint) in (dict, Mapping):
        return isinstance(value, dict) and all(_is_of(one, of[1]) for one in value.values())
    if get_origin(hint) in (tuple, Sequence):
        any_length = get_origin(hint) is Sequence or Ellipsis in of
        return (
            isinstance(value, list)
            and (any_length or len(value) == len(of))
            and all(_is_of(one, of[0]) for one in value)
        )
    if hint is float:  # NaN is one
        return type(value) in (int, float) and not abs(value) > LARGEST_NUMBER  # type: ignore[arg-type] # a number
    if hint is int:
        return type(value) is int and abs(value) < 2**63
    return type(value) is hint


def _typed(value: Any, hint: Any) -> Any:
    return tuple(value) if get_origin(hint) is tuple else value
