"""The table ``observations.csv``: one row an instant, an empty field where nothing was measured."""

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.experiment.holds import FloatArray
from estimator.experiment.model import PHASES, WRENCH_CHANNELS, Experiment
from estimator.input_file import parse_number, read_input_text

_POSE_COLUMNS = ("time", "px", "py", "pz", "qw", "qx", "qy", "qz")
WRENCH_COLUMNS = WRENCH_CHANNELS
_LONGEST_STEP = 9  # digits
_ANY_FIDUCIAL = re.compile(r"m\d{2,}[xyz]")


@dataclass(frozen=True, slots=True, eq=False)
class Observations:
    """What the table holds, in the shapes of :class:`~estimator.experiment.model.Experiment`."""

    time: FloatArray
    phase: tuple[str, ...]
    step: NDArray[np.int64]
    position: FloatArray
    quaternion_wxyz: FloatArray
    wrench: FloatArray
    fiducials: FloatArray


def fiducial_columns(count: int) -> tuple[str, ...]:
    """Return the names of the columns of ``count`` fiducials: m00x, m00y, m00z, m01x and so on."""
    return tuple(f"m{i:02d}{axis}" for i in range(count) for axis in "xyz")


def line_of_row(row: int) -> int:
    """Return the line of the file that holds a row (from 0); line 1 is the header."""
    return row + 2


def read_observations(file: Path, fiducial_count: int) -> Observations:
    """Read the table; only the columns of the format are looked at, in whatever order they stand.

    Raises
    ------
    InputError
        The file or a column is missing, a row is incomplete, a field is no number, or a pose is empty.
    """
    header, rows = _read_rows(file)
    columns = ("phase", "step", *_POSE_COLUMNS, *WRENCH_COLUMNS, *fiducial_columns(fiducial_count))
    _check_header(file, header, columns, fiducial_count)
    place = {name: header.index(name) for name in columns}
    table = _Table(file, rows, place)
    pose = table.numbers(_POSE_COLUMNS, may_be_empty=False)
    return Observations(
        time=pose[:, 0],
        phase=table.phases(),
        step=table.steps(),
        position=pose[:, 1:4],
        quaternion_wxyz=pose[:, 4:8],
        wrench=table.numbers(WRENCH_COLUMNS, may_be_empty=True),
        fiducials=table.numbers(fiducial_columns(fiducial_count), may_be_empty=True).reshape(
            len(rows), fiducial_count, 3
        ),
    )


def columns_of(experiment: Experiment) -> dict[str, list[Any]]:
    """Return the columns of the table of an experiment by their names; NaN stands where nothing was measured."""
    rows = len(experiment.time)
    pose = np.column_stack([experiment.position, experiment.quaternion_wxyz])
    measured = np.column_stack([experiment.wrench, experiment.fiducials.reshape(rows, -1)])
    names = (*_POSE_COLUMNS[1:], *WRENCH_COLUMNS, *fiducial_columns(len(experiment.fiducials_rest)))
    numbers = np.column_stack([pose, measured]).T.tolist()
    return {
        "time": experiment.time.tolist(),
        "phase": list(experiment.phase),
        "step": experiment.step.tolist(),
        **dict(zip(names, numbers, strict=True)),
    }


def write_observations(file: Path, experiment: Experiment) -> None:
    """Write the table of an experiment with every digit that its numbers have."""
    columns = columns_of(experiment)
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(columns)
        for row in zip(*columns.values(), strict=True):
            writer.writerow([_field(value) for value in row])


def _field(value: object) -> object:
    if not isinstance(value, float):
        return value
    return "" if np.isnan(value) else repr(value)


def _read_rows(file: Path) -> tuple[list[str], list[list[str]]]:
    try:
        stream = io.StringIO(read_input_text(file), newline="")
        lines = [[field.strip() for field in line] for line in csv.reader(stream)]
    except csv.Error as error:
        raise InputError(f"{file}: not readable as CSV: {error}; save it as comma-separated UTF-8") from None
    while lines and not any(lines[-1]):
        lines.pop()
    if len(lines) < 3:
        raise InputError(f"{file}: {max(len(lines) - 1, 0)} rows below the header; at least two are needed")
    header, *rows = lines
    for row, fields in enumerate(rows):
        if len(fields) != len(header):
            raise InputError(
                f"{file}, line {line_of_row(row)}: {len(fields)} fields, but the header has {len(header)}; "
                "complete the row, leaving a field empty where nothing was measured"
            )
    return header, rows


def _check_header(file: Path, header: Sequence[str], columns: Sequence[str], fiducial_count: int) -> None:
    if len(header) == 1:
        raise InputError(f"{file}, line 1: only one column; separate the columns by commas")
    if len(set(header)) != len(header):
        twice = next(name for name in header if header.count(name) > 1)
        raise InputError(f"{file}, line 1: column {twice} stands there twice; remove one")
    measured = {name for name in header if _ANY_FIDUCIAL.fullmatch(name)}
    stated = set(fiducial_columns(fiducial_count))
    if measured != stated:
        odd = min(measured ^ stated)
        raise InputError(
            f"{file}, line 1: {len(measured)} fiducial columns, but [fiducials] rest lists {fiducial_count} "
            f"fiducials, which need {len(stated)} (first difference: {odd}); make both agree"
        )
    for name in columns:
        if name not in header:
            raise InputError(f"{file}, line 1: column {name} is missing; add it")


class _Table:
    """Rows of text with the place of each named column."""

    def __init__(self, file: Path, rows: list[list[str]], place: dict[str, int]) -> None:
        self._file = file
        self._rows = rows
        self._place = place

    def numbers(self, columns: Sequence[str], *, may_be_empty: bool) -> FloatArray:
        values = np.full((len(self._rows), len(columns)), np.nan)
        for j, column in enumerate(columns):
            place = self._place[column]
            for i, row in enumerate(self._rows):
                text = row[place]
                if text:
                    values[i, j] = self._number(text, i, column)
                if not may_be_empty and not np.isfinite(values[i, j]):
                    raise self._error(i, column, f"'{text}', but time and pose must be known in every row")
        return values

    def phases(self) -> tuple[str, ...]:
        phases = tuple(row[self._place["phase"]] for row in self._rows)
        for i, phase in enumerate(phases):
            if phase not in PHASES:
                raise self._error(i, "phase", f"'{phase}' is no phase; write one of {', '.join(PHASES)}")
        return phases

    def steps(self) -> NDArray[np.int64]:
        texts = [row[self._place["step"]] for row in self._rows]
        for i, text in enumerate(texts):
            if not (text.isascii() and text.isdigit() and len(text) <= _LONGEST_STEP):
                raise self._error(i, "step", f"'{text[:40]}' is no step number; write a whole number from 0")
        return np.array(texts, dtype=np.int64)

    def _number(self, text: str, row: int, column: str) -> float:
        try:
            value = parse_number(text)
        except ValueError:
            raise self._error(
                row,
                column,
                f"'{text}' is no number; write a decimal number, or nothing where none was measured",
            ) from None
        if np.isinf(value):
            raise self._error(
                row, column, f"'{text}' is infinite; leave the field empty if none was measured"
            )
        return value

    def _error(self, row: int, column: str, text: str) -> InputError:
        return InputError(f"{self._file}, line {line_of_row(row)}, column {column}: {text}")
