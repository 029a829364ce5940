"""Typed access to a TOML file; every refusal names the file, the key, what is wrong and what to write."""

from pathlib import Path
from typing import Any

import numpy as np

from estimator.errors import InputError
from estimator.experiment.holds import AXES, Axis, Box, FloatArray, Vector
from estimator.input_file import is_number, parse_toml, read_input_text


class TomlTable:
    """One table of a TOML file. A getter without a default demands its key."""

    def __init__(self, data: dict[str, Any], file: Path, name: str = "") -> None:
        self._data = data
        self._file = file
        self._name = name

    @classmethod
    def read(cls, file: Path) -> "TomlTable":
        """Parse a TOML file.

        Raises
        ------
        InputError
            The file is missing, cannot be read, or is no TOML.
        """
        return cls(parse_toml(read_input_text(file), file), file)

    def __contains__(self, key: str) -> bool:
        return key in self._data

    def table(self, key: str) -> "TomlTable":
        """Return the table [key], empty where the file has none."""
        return self._child(self._data.get(key, {}), f"[{key}]")

    def tables(self, key: str) -> tuple["TomlTable", ...]:
        """Return the array of tables [[key]], empty where the file has none."""
        data = self._data.get(key, [])
        if not isinstance(data, list):
            raise self.error(key, f"is no list of tables; head each one with [[{key}]]")
        return tuple(self._child(entry, f"[[{key}]] {i}") for i, entry in enumerate(data, start=1))

    def text(self, key: str, default: str | None = None) -> str:
        """Return a string."""
        value = self._get(key, default)
        if not isinstance(value, str):
            raise self.error(key, f"is {value!r}; write a text in quotes")
        return value

    def choice(self, key: str, choices: tuple[str, ...], default: str | None = None) -> str:
        """Return one of ``choices``."""
        value = self.text(key, default)
        if value not in choices:
            raise self.error(key, f'is "{value}"; write one of {", ".join(choices)}')
        return value

    def flag(self, key: str) -> bool:
        """Return true or false."""
        value = self._get(key, None)
        if not isinstance(value, bool):
            raise self.error(key, f"is {value!r}; write true or false")
        return value

    def axes(self, key: str, default: tuple[Axis, ...] | None = None) -> tuple[Axis, ...]:
        """Return some of x, y, z, in that order."""
        value = self._get(key, default)
        if not (isinstance(value, list | tuple) and value and all(one in AXES for one in value)):
            raise self.error(key, f'is {value!r}; write a list of some of "x", "y", "z"')
        return tuple(axis for axis in AXES if axis in value)

    def integer(self, key: str, default: int | None = None) -> int:
        """Return an integer."""
        value = self._get(key, default)
        if isinstance(value, bool) or not isinstance(value, int):
            raise self.error(key, f"is {value!r}; write a whole number")
        return value

    def number(self, key: str, default: float | None = None) -> float:
        """Return a finite number."""
        value = self._get(key, default)
        if not is_number(value):
            raise self.error(key, f"is {value!r}; write a finite number")
        return float(value)

    def vector(self, key: str, default: Vector | None = None) -> Vector:
        """Return three finite numbers."""
        value = self._get(key, default)
        if not _is_vector(value):
            raise self.error(key, f"is {value!r}; write three numbers, [x, y, z]")
        return float(value[0]), float(value[1]), float(value[2])

    def points(self, key: str) -> FloatArray:
        """Return a list of points, (m, 3); (0, 3) where the key is missing."""
        value = self._data.get(key, [])
        if not isinstance(value, list):
            raise self.error(key, f"is {value!r}; write a list of points, [[x, y, z], ...]")
        for i, point in enumerate(value):
            if not _is_vector(point):
                raise self.error(key, f"number {i} (from 0) is {point!r}; write three numbers, [x, y, z]")
        return np.array(value, dtype=np.float64).reshape(-1, 3)

    def box(self, key: str) -> Box:
        """Return the box between two opposite corners, in whatever order they are given."""
        value = self._get(key, None)
        if not (isinstance(value, list) and len(value) == 2 and all(_is_vector(corner) for corner in value)):
            raise self.error(key, f"is {value!r}; write two opposite corners, [[x, y, z], [x, y, z]]")
        (x0, y0, z0), (x1, y1, z1) = np.sort(np.array(value, dtype=np.float64), axis=0).tolist()
        return Box((x0, y0, z0), (x1, y1, z1))

    def error(self, key: str, text: str) -> InputError:
        """Return the refusal of a key's value, which a text describes."""
        place = f"{self._name} {key}" if self._name else key
        return InputError(f"{self._file}: {place} {text}")

    def _get(self, key: str, default: object) -> Any:
        value = self._data.get(key, default)
        if value is None:
            raise self.error(key, "is missing; add it")
        return value

    def _child(self, data: object, name: str) -> "TomlTable":
        if not isinstance(data, dict):
            raise InputError(f"{self._file}: {name} is no table; put its keys below that heading")
        return TomlTable(data, self._file, name)


def _is_vector(value: object) -> bool:
    return isinstance(value, list | tuple) and len(value) == 3 and all(is_number(entry) for entry in value)
