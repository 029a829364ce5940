"""The answers to sealed cases, and the count of how often they were opened."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from estimator.blind.scoring.labels import within_catalogue
from estimator.errors import InputError
from estimator.input_file import is_number, parse_toml, read_input_text

KEY_FILE = "truth.toml"
OPENINGS_FILE = "openings.txt"

_MATERIAL = ("youngs_modulus", "poisson_ratio")


@dataclass(frozen=True, slots=True)
class Key:
    """The truth of one case.

    Attributes
    ----------
    effects : labels; empty for none, "unknown" for one outside the catalogue
    youngs_modulus : Pa
    poisson_ratio : of the tissue
    centre : of a local effect, m; None where there is none
    level : by how much the effect stands out: clear, moderate, subtle, …; empty where the key does not say
    ceiling : probability with which the best possible test would name the cause first; None where it is not stated
    """

    effects: tuple[str, ...]
    youngs_modulus: float
    poisson_ratio: float
    centre: tuple[float, float, float] | None
    level: str
    ceiling: float | None


def open_keys(folder: Path, reader: str) -> tuple[dict[str, Key], int]:
    """Read all keys in a folder by the name of their case, count the opening, and return how many there have been.

    A key is ``CASE/truth.toml`` or ``CASE.toml``. Each opening is a line in ``openings.txt`` beside them.

    Parameters
    ----------
    reader : what the keys are opened for, one line

    Raises
    ------
    InputError
        There is no key, or one cannot be read.
    """
    files = _key_files(folder)
    openings = _count_opening(folder / OPENINGS_FILE, reader)
    return {name: _read_key(file) for name, file in files.items()}, openings


def read_keys(folder: Path) -> dict[str, Key]:
    """Read all keys in a folder as :func:`open_keys` does, without counting: for who makes or checks them."""
    return {name: _read_key(file) for name, file in _key_files(folder).items()}


def _key_files(folder: Path) -> dict[str, Path]:
    files = {file.parent.name: file for file in sorted(folder.glob(f"*/{KEY_FILE}"))}
    files |= {file.stem: file for file in sorted(folder.glob("*.toml"))}
    if not files:
        raise InputError(f"{folder}: holds no key; give a folder with CASE/{KEY_FILE} or CASE.toml")
    return files


def _count_opening(file: Path, reader: str) -> int:
    with file.open("a", encoding="utf-8") as log:
        log.write(f"{datetime.now(UTC).isoformat(timespec='seconds')} {reader}\n")
    return len(file.read_text(encoding="utf-8").splitlines())


def _read_key(file: Path) -> Key:
    stated = parse_toml(read_input_text(file), file)
    generator, where = stated.get("generator", {}), stated.get("where", {})
    effects = stated.get("effects")
    if not isinstance(effects, list) or not all(isinstance(label, str) for label in effects):
        raise InputError(f"{file}: effects is no list of labels; an empty list says that there is none")
    modulus, ratio = (_number(stated, name, file) for name in _MATERIAL)
    level = generator.get("level", "")
    return Key(
        effects=within_catalogue(effects),
        youngs_modulus=modulus,
        poisson_ratio=ratio,
        centre=_point(where["centre"], file) if "centre" in where else None,
        level=level if isinstance(level, str) else " and ".join(level),
        ceiling=_number(generator, "ceiling", file) if "ceiling" in generator else None,
    )


def _number(table: Mapping[str, Any], name: str, file: Path) -> float:
    value = table.get(name)
    if not is_number(value):
        raise InputError(f"{file}: {name} is missing or no number; state it")
    return float(value)


def _point(value: object, file: Path) -> tuple[float, float, float]:
    if isinstance(value, list) and len(value) == 3 and all(map(is_number, value)):
        x, y, z = map(float, value)
        return x, y, z
    raise InputError(f"{file}: [where] centre is {value}; state three numbers in metres")
