"""Stress-strain records of tensile and compression tests, read from whatever layout names its columns.

Known layouts: the tensile tests of the Soft Robotics Materials Database (Marechal et al. 2020; semicolons,
facts of the test above the table), the compression tests of the tissue phantom material database (Dawood et
al. 2026; commas, facts above the table), and a bare table of two columns. They are told apart by content.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.input_file import parse_number, read_input_text

FloatArray = NDArray[np.float64]
Mode = Literal["tension", "compression"]

_STRESS_UNITS = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6}
_STRAIN_UNITS = {"-": 1.0, "mm/mm": 1.0, "%": 1e-2}
_UNIT = re.compile(r"[(\[]\s*(.*?)\s*[)\]]$|[\s_](k?Pa|MPa|%)$")
_FACT = re.compile(r"([^;:,]+)[;:,]\s*([^;]*)")
_NUMBER = re.compile(r"\d+(\.\d+)?")

_FEWEST_ROWS = 6
_STRAIN_LIMIT = 20.0  # silicones fail at up to 17
_MODULUS_RANGE = (100.0, 1e9)  # Pa, secant at the largest strain: jelly to hard plastic


@dataclass(frozen=True, slots=True, eq=False)
class UniaxialRecord:
    """One loading of one specimen.

    Attributes
    ----------
    name : the file's, without its suffix
    mode : the sign that strain and stress have at the end
    strain : (n,) engineering strain; compression is negative
    stress : (n,) engineering (nominal) stress, Pa; compression is negative
    facts : what the file states above its table, as text
    path : the file it was read from; None where it was made in memory
    """

    name: str
    mode: Mode
    strain: FloatArray
    stress: FloatArray
    facts: Mapping[str, str] = field(default_factory=dict)
    path: Path | None = None

    @property
    def shape_factor(self) -> float | None:
        """Loaded over free area of a cylinder, diameter / (4 height); None where the file states none."""
        diameter, height = self._length("diameter"), self._length("height")
        return None if diameter is None or height is None else diameter / (4 * height)

    @property
    def strain_from_crosshead(self) -> bool:
        """Whether the file states that strain is the machine's travel, which carries slack and grip slip."""
        return any("crosshead" in value.lower() for value in self.facts.values())

    def _length(self, word: str) -> float | None:
        for key, value in self.facts.items():
            number = _NUMBER.search(value)
            if word in key.lower() and number:
                return float(number.group())
        return None


def read_record(path: Path | str) -> UniaxialRecord:
    """Read a record. Units stand in the columns' names, as in ``stress (kPa)``; without any they are Pa, 1.

    Only the first loading is kept: the rows up to the largest strain.

    Raises
    ------
    InputError
        The file is missing or no such table, a field is no number, or the values cannot be stress and strain.
    """
    file = Path(path)
    lines = read_input_text(file).splitlines()
    header = _header_line(file, lines)
    titles = [] if header is None else _split(lines[header])
    strain_column, strain_unit = _column(file, header, titles, "strain", _STRAIN_UNITS)
    stress_column, stress_unit = _column(file, header, titles, "stress", _STRESS_UNITS)
    first = 0 if header is None else header + 1
    rows = [
        (_number(file, line, fields, strain_column), _number(file, line, fields, stress_column))
        for line, fields in ((i + 1, _split(lines[i])) for i in range(first, len(lines)))
        if any(fields)
    ]
    strain, stress = np.array(rows, dtype=np.float64).reshape(-1, 2).T * [[strain_unit], [stress_unit]]
    _check(file, strain, stress)
    end = int(np.argmax(np.abs(strain)))
    return UniaxialRecord(
        name=file.stem,
        mode="tension" if strain[end] > 0 else "compression",
        strain=strain[: end + 1],
        stress=stress[: end + 1],
        facts=_facts(lines[: header or 0]),
        path=file,
    )


def _split(line: str) -> list[str]:
    """Split at semicolons where there are any (a comma is a decimal mark then), else at commas or tabs."""
    if ";" in line:
        return [part.strip().replace(",", ".") for part in line.split(";")]
    return [part.strip() for part in re.split(r"[,\t]", line)]


def _header_line(file: Path, lines: Sequence[str]) -> int | None:
    """Return the index of the line that names the columns, None where the file starts with numbers."""
    for i, line in enumerate(lines):
        titles = [title.lower() for title in _split(line)]
        if any("strain" in title for title in titles) and any("stress" in title for title in titles):
            return i
    fields = _split(lines[0]) if lines else []
    if len(fields) == 2 and all(_is_number(text) for text in fields):
        return None
    raise InputError(
        f"{file}: no line names a strain and a stress column; write 'strain,stress (kPa)' above the table"
    )


def _column(
    file: Path, header: int | None, titles: Sequence[str], kind: str, units: Mapping[str, float]
) -> tuple[int, float]:
    """Return the place of the engineering quantity and the factor to SI."""
    if header is None:
        return ("strain", "stress").index(kind), 1.0
    candidates = [
        i for i, title in enumerate(titles) if kind in title.lower() and "true" not in title.lower()
    ]
    if not candidates:
        raise InputError(
            f"{file}, line {header + 1}: only true {kind}; give engineering {kind} (per initial size)"
        )
    engineering = [i for i in candidates if re.search("engineering|nominal", titles[i], re.IGNORECASE)]
    column = (engineering or candidates)[0]
    marked = _UNIT.search(titles[column])
    unit = marked and (marked[1] or marked[2])
    if unit and unit not in units:
        known = ", ".join(units)
        raise InputError(
            f"{file}, line {header + 1}: the unit of '{titles[column]}' is none of {known}; convert it"
        )
    return column, units[unit] if unit else 1.0


def _number(file: Path, line: int, fields: Sequence[str], column: int) -> float:
    if column >= len(fields):
        raise InputError(
            f"{file}, line {line}: {len(fields)} fields; field {column + 1} is needed, complete the row"
        )
    if not _is_number(fields[column]):
        raise InputError(
            f"{file}, line {line}, field {column + 1}: '{fields[column]}' is no number; correct it"
        )
    return float(fields[column])


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(parse_number(text))
    except ValueError:
        return False


def _facts(lines: Sequence[str]) -> dict[str, str]:
    matches = (_FACT.match(line) for line in lines)
    facts = {match[1].strip(): match[2].strip() for match in matches if match}
    return {name: value for name, value in facts.items() if value and name.lower() != "parameter"}


def _check(file: Path, strain: FloatArray, stress: FloatArray) -> None:
    if len(strain) < _FEWEST_ROWS:
        raise InputError(f"{file}: {len(strain)} rows; at least {_FEWEST_ROWS} are needed")
    end = int(np.argmax(np.abs(strain)))
    if np.abs(strain[end]) > _STRAIN_LIMIT or strain.min() <= -1:
        raise InputError(
            f"{file}: strain reaches {strain[end]:g}; write a fraction of the length, or mark the column (%)"
        )
    if strain[end] == 0 or float(strain @ stress) <= 0:
        raise InputError(f"{file}: stress and strain have opposite signs; write both negative in compression")
    low, high = _MODULUS_RANGE
    secant = stress[end] / strain[end]
    if not low <= secant <= high:
        raise InputError(
            f"{file}: stress over strain is {secant:.3g} Pa at the end; name the unit, as in 'stress (kPa)'"
        )
