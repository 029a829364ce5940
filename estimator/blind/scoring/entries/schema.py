"""What the JSON Schema of answers finds wrong, in words that say what to do."""

import difflib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError

SCHEMA_FILE = "answers.schema.json"

_KINDS = {"object": "an object {…}", "array": "a list […]", "string": "a text", "number": "a number"}
_LONGEST_VALUE = 60


@dataclass(frozen=True, slots=True)
class Fault:
    """Something wrong: where in a file, what, and what to do."""

    where: str
    what: str
    advice: str

    def __str__(self) -> str:
        """One line."""
        return f"{self.where}: {self.what}; {self.advice}"


@cache
def answers_schema() -> dict[str, Any]:
    """Return the JSON Schema of ``retraction-answers/1`` (draft 2020-12)."""
    text = files(__package__).joinpath(SCHEMA_FILE).read_text(encoding="utf-8")
    return dict(json.loads(text))


def labels() -> tuple[str, ...]:
    """Return the labels that an answer may give a probability to."""
    return tuple(answers_schema()["$defs"]["label"]["enum"])


def schema_faults(told: object) -> Iterator[Fault]:
    """Give all that the schema finds wrong with parsed JSON, in the order of the file."""
    found = Draft202012Validator(answers_schema()).iter_errors(told)
    for error in sorted(found, key=lambda one: [str(part) for part in one.absolute_path]):
        yield from _faults_of(error)


def place(path: Sequence[object]) -> str:
    """Return a path within JSON as text, such as ``answers.case001.place[2]``."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)
    return text.removeprefix(".") or "the file"


def _faults_of(error: ValidationError) -> Iterator[Fault]:
    where, rule, value = place(list(error.absolute_path)), error.validator_value, shown(error.instance)
    match error.validator:
        case "required":
            yield from (
                Fault(where, f"{name} is missing", "add it") for name in rule if name not in error.instance
            )
        case "additionalProperties":
            known = list(error.schema.get("properties", ()))
            for name in error.instance:
                if name not in known:
                    yield Fault(where, f"{name!r} is not known here", _instead(name, known))
        case "enum" if "propertyNames" in error.absolute_schema_path:
            yield Fault(where, f"{value} is no name that is known here", _instead(str(error.instance), rule))
        case "enum" | "const":
            allowed = rule if error.validator == "enum" else [rule]
            yield Fault(where, f"{value} is not known here", _instead(str(error.instance), allowed))
        case "type":
            yield Fault(where, f"{value} is not {_KINDS[rule]}", f"write {_KINDS[rule]}")
        case "minimum":
            yield Fault(where, f"{value} is too small", f"state {rule} or more")
        case "exclusiveMinimum":
            yield Fault(where, f"{value} is too small", f"state more than {rule}")
        case "maximum":
            yield Fault(where, f"{value} is too large", f"state {rule} or less")
        case "pattern":
            meant = answers_schema()["properties"].get(where, {}).get("description", f"it must match {rule}")
            yield Fault(where, f"{value} is not as it must be", f"write {meant}")
        case "uniqueItems":
            yield Fault(where, "something stands there twice", "name it once")
        case "minItems" | "minLength" | "minProperties":
            yield Fault(where, f"{value} is too short", f"{rule} at least must stand there")
        case "maxItems" | "maxLength" | "maxProperties":
            yield Fault(where, f"{value} is too long", f"{rule} at most may stand there")
        case _:
            yield Fault(where, error.message, "see the schema")


def shown(value: object) -> str:
    """Return a value of JSON as it is quoted in a complaint, cut off where it is long."""
    if isinstance(value, dict):
        return "{…}" if value else "{}"
    if isinstance(value, list):
        return "[…]" if value else "[]"
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= _LONGEST_VALUE else f"{text[:_LONGEST_VALUE]}…"


def _instead(name: str, known: Sequence[str]) -> str:
    close = difflib.get_close_matches(name, known, n=1)
    if close:
        return f"did you mean {close[0]}?"
    return f"choose from {', '.join(known)}" if known else "leave it out"
