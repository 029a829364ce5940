"""C3D: markers and analog channels of motion capture.

The library reads the header and the parameters; the frames are decoded here. The count of frames in the header has 16
bits, and programs write 65535 there when there are more: libraries then return 65535 frames, or none. Here the count is
that of TRIAL:ACTUAL_END_FIELD or POINT:LONG_FRAMES, else what the size of the file holds.

Reference: The C3D File Format User Guide, Motion Lab Systems (2008).
"""

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from estimator.errors import InputError
from estimator.importing.table import Column, FloatArray, Source, Table, require_tables

MAGIC = 0x50
_BLOCK = 512
_MOST_IN_HEADER = 65535
_ORDERS = {"INTEL": "<", "MIPS": ">"}
_MOST_BYTES = 4_000_000_000


def read_c3d(file: Path) -> Source:
    """Read the markers as one table, in their unit, and the analog channels as another, scaled.

    A marker that was not seen has a negative residual and is NaN.

    Raises
    ------
    InputError
        The library is missing, or the file cannot be read.
    """
    try:
        import c3d
    except ImportError:
        raise InputError(f"{file}: C3D needs the library c3d; pip install 'retraction[c3d]'") from None
    try:
        with warnings.catch_warnings(), file.open("rb") as stream:
            warnings.simplefilter("ignore")
            reader = c3d.Reader(stream)
            points, analog, facts = _decoded(file, reader)
    except InputError:
        raise
    except Exception as error:  # noqa: BLE001 - a damaged file makes the library raise whatever it comes upon
        raise InputError(
            f"{file}: is not readable as C3D ({type(error).__name__}); export it again, or as CSV"
        ) from None
    rate = float(reader.point_rate)
    tables = []
    if points is not None:
        names = _labels(reader, "POINT", points.shape[1], "marker")
        unit = _word(reader, "POINT:UNITS") or None
        columns = [
            Column(f"{name}.{axis}", points[:, place, k], unit)
            for place, name in enumerate(names)
            for k, axis in enumerate("xyz")
        ]
        tables.append(Table("points", tuple(columns), rate or None, facts))
    if analog is not None:
        names = _labels(reader, "ANALOG", analog.shape[1], "analog")
        units = _words(reader, "ANALOG:UNITS")
        per_frame = len(analog) / max(len(points) if points is not None else len(analog), 1)
        columns = [
            Column(name, analog[:, place], (units[place].strip() or None) if place < len(units) else None)
            for place, name in enumerate(names)
        ]
        tables.append(Table("analog", tuple(columns), rate * per_frame or None, facts))
    return Source(file, require_tables(file, tables, "is read as C3D"), "C3D")


def _decoded(file: Path, reader: Any) -> tuple[FloatArray | None, FloatArray | None, dict[str, str]]:
    processor = str(reader.proc_type)
    if processor not in _ORDERS:
        raise InputError(f"{file}: its numbers are those of a DEC computer; save it again in Intel format")
    markers = int(reader.point_used)
    samples = int(reader.header.analog_per_frame)
    channels = int(reader.analog_used) if samples else 0
    floats = float(reader.point_scale) < 0
    kind = np.dtype(f"{_ORDERS[processor]}{'f4' if floats else 'i2'}")
    words = 4 * markers + channels * samples
    start = (int(reader.header.data_block) - 1) * _BLOCK
    size = file.stat().st_size
    if not words or start >= size or size > _MOST_BYTES:
        raise InputError(f"{file}: holds neither markers nor analog channels; export it again")
    available = (_end_of_points(reader, size) - start) // (words * kind.itemsize)
    frames, stated = _frames(reader, available)
    data = np.fromfile(file, kind, frames * words, offset=start).reshape(frames, words).astype(np.float64)
    if _is_counted_by_size(stated, available):
        # what fills the last block of the file is no frame
        full = np.flatnonzero(data.any(axis=1))
        most_padding = _BLOCK // (words * kind.itemsize) + 1
        last = int(full[-1]) + 1 if len(full) else frames
        frames = max(last, frames - most_padding)
        data = data[:frames]
    facts = {"frames": str(frames), "frames in the header": str(stated)}
    for name in ("POINT:X_SCREEN", "POINT:Y_SCREEN", "MANUFACTURER:COMPANY", "MANUFACTURER:SOFTWARE"):
        if word := _word(reader, name):
            facts[name] = word
    return (
        _points(data[:, : 4 * markers].reshape(frames, markers, 4), reader, floats) if markers else None,
        _analog(data[:, 4 * markers :].reshape(frames * samples, channels), reader) if channels else None,
        facts,
    )


def _frames(reader: Any, available: int) -> tuple[int, int]:
    """Return how many frames there are, and how many the header states."""
    stated = int(reader.header.last_frame) - int(reader.header.first_frame) + 1
    start, end = (_long(reader, f"TRIAL:ACTUAL_{which}_FIELD") for which in ("START", "END"))
    counts = [_number(reader, "POINT:LONG_FRAMES"), end - start + 1 if end and start else 0]
    known = [int(count) for count in counts if _MOST_IN_HEADER < count <= available]
    if known:
        return known[0], stated
    return (available if _is_counted_by_size(stated, available) else min(stated, available)), stated


def _is_counted_by_size(stated: int, available: int) -> bool:
    return stated >= _MOST_IN_HEADER - 1 and available > stated


def _end_of_points(reader: Any, size: int) -> int:
    """Return where the data of markers and analog channels end: before data of rotations, or at the file's end."""
    if _number(reader, "ROTATION:USED") > 0 and (block := int(_number(reader, "ROTATION:DATA_START"))) > 0:
        return (block - 1) * _BLOCK
    return size


def _points(values: FloatArray, reader: Any, floats: bool) -> FloatArray:
    places = values[..., :3] * (1.0 if floats else abs(float(reader.point_scale)))
    places[values[..., 3] < 0] = np.nan
    return np.asarray(places)


def _analog(values: FloatArray, reader: Any) -> FloatArray:
    channels = values.shape[1]
    general = _number(reader, "ANALOG:GEN_SCALE") or 1.0
    scale, offset = (
        _numbers(reader, "ANALOG:SCALE", channels, 1.0),
        _numbers(reader, "ANALOG:OFFSET", channels, 0.0),
    )
    return np.asarray((values - offset) * scale * general)


def _labels(reader: Any, group: str, count: int, default: str) -> list[str]:
    """Return the names of the channels, which go on in LABELS2, LABELS3 where there are more than 255."""
    names = _words(reader, f"{group}:LABELS")
    number = 2
    while len(names) < count and (more := _words(reader, f"{group}:LABELS{number}")):
        names, number = [*names, *more], number + 1
    names = [name.strip() for name in names[:count]]
    kept: list[str] = []
    for place in range(count):
        name = names[place] if place < len(names) and names[place] else f"{default}{place + 1}"
        kept.append(name if name not in kept else f"{name} ({place + 1})")
    return kept


def _words(reader: Any, name: str) -> list[str]:
    parameter = reader.get(name)
    if parameter is None:
        return []
    words = parameter.string_array if len(parameter.dimensions) > 1 else parameter.string_value
    return [str(word).strip() for word in np.atleast_1d(words).ravel()]


def _word(reader: Any, name: str) -> str:
    return next(iter(_words(reader, name)), "")


def _number(reader: Any, name: str) -> float:
    parameter = reader.get(name)
    if parameter is None or not parameter.bytes:
        return 0.0
    return float(_values(parameter)[0])


def _numbers(reader: Any, name: str, count: int, default: float) -> FloatArray:
    parameter = reader.get(name)
    found = _values(parameter)[:count] if parameter is not None and parameter.bytes else np.zeros(0)
    return np.concatenate([found, np.full(count - len(found), default)])


def _long(reader: Any, name: str) -> int:
    """Return a whole number that is stored as two of 16 bits, the lower first."""
    parameter = reader.get(name)
    if parameter is None or not parameter.bytes:
        return 0
    values = _values(parameter)
    if len(values) < 2:
        return int(values[0])
    return (int(values[0]) & 0xFFFF) + (int(values[1]) << 16)


def _values(parameter: Any) -> FloatArray:
    kind = {4: "float", 2: "int16", 1: "int8"}[int(parameter.bytes_per_element)]
    # the library has other names for a single number
    values = getattr(parameter, f"{kind}_{'array' if len(parameter.dimensions) else 'value'}")
    return np.atleast_1d(np.asarray(values, dtype=np.float64)).ravel()
