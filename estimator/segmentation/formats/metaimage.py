"""Label maps in MetaImage (.mha, and .mhd with its data file), as ITK writes them.

No library of a few megabytes reads the format. Layout: "MetaIO", https://itk.org/Wiki/MetaIO/Documentation. Each row of
``TransformMatrix`` is the direction of one axis of the grid.
"""

import zlib
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.input_file import read_input
from estimator.segmentation.label_map import LabelMap, whole_numbers

FloatArray = NDArray[np.float64]

# Names of the format, and numpy's.
_TYPES = {
    f"MET_{sign}{name}": f"{'u' if sign else 'i'}{size}"
    for name, size in (("CHAR", 1), ("SHORT", 2), ("INT", 4), ("LONG", 4), ("LONG_LONG", 8))
    for sign in ("", "U")
} | {"MET_FLOAT": "f4", "MET_DOUBLE": "f8"}
_UNITS_MM = {"mm": 1.0, "um": 1e-3, "cm": 10.0}
# No coordinate of an image is as large.
_FARTHEST_MM = 1e9
_LONGEST_HEADER = 100_000
_DATA = "ElementDataFile"


def read_metaimage(file: Path, most_bytes: int) -> LabelMap:
    """Return the labels of a file, and of the data file that it names; it holds at most so many bytes of them.

    Raises
    ------
    InputError
        It is damaged or cut short, its data are missing, or of a kind that labels do not have.
    """
    content = read_input(file, most_bytes)
    header, after = _header(content, file)
    try:
        shape = tuple(int(word) for word in header.get("DimSize", "").split())
        kind = np.dtype(_TYPES[_one_of(header, "ElementType", _TYPES)])
        T_lps_index = _placed(header, len(shape))
        channels = int(header.get("ElementNumberOfChannels", "1"))
    except (ValueError, OverflowError) as error:
        raise InputError(
            f"{file}: its header is not as the format has it ({error}); write the image again"
        ) from None
    count = int(np.prod(np.array(shape, dtype=object)))
    if channels != 1 or count <= 0 or count * kind.itemsize > most_bytes:
        raise InputError(
            f"{file}: {channels} values for each of {count} voxels; a segmentation has one, and is at most "
            f"{most_bytes / 1e6:.0f} MB large"
        )
    data = _data(header, content[after:], file, most_bytes)
    if header.get("BinaryData", "True").lower() == "false":
        values = np.array(data.split(), dtype=np.float64)
    else:
        big = (
            header.get("BinaryDataByteOrderMSB", header.get("ElementByteOrderMSB", "False")).lower() == "true"
        )
        data = _unpacked(data, header, count * kind.itemsize, file)
        values = np.frombuffer(data, kind.newbyteorder(">" if big else "<"), len(data) // kind.itemsize)
    if len(values) != count:
        raise InputError(
            f"{file}: there are {len(values)} voxels of {count}: the data are cut short; copy both parts again"
        )
    labels = whole_numbers(values, str(file)).reshape(shape, order="F")
    return LabelMap((labels,), T_lps_index)


def _header(content: bytes, file: Path) -> tuple[dict[str, str], int]:
    """Return the fields of a header, and where the data begin that stand behind it."""
    fields, start = dict[str, str](), 0
    while start < min(len(content), _LONGEST_HEADER):
        end = content.find(b"\n", start)
        end = len(content) if end < 0 else end
        key, separator, value = content[start:end].decode("latin-1").partition("=")
        start = end + 1
        if separator:
            fields[key.strip()] = value.strip()
        if key.strip() == _DATA:
            return fields, start
    raise InputError(f"{file}: its header does not end with {_DATA}; write the image again")


def _placed(header: Mapping[str, str], axes: int) -> FloatArray:
    """Return the way from index to LPS, mm."""
    if axes != 3:
        raise ValueError(f"DimSize of {axes} axes, not three")
    matrix = _numbers(header, ("TransformMatrix", "Rotation", "Orientation"), np.eye(3).ravel())
    spacing = _numbers(header, ("ElementSpacing", "ElementSize"), np.ones(3))
    origin = _numbers(header, ("Offset", "Position", "Origin"), np.zeros(3))
    T_lps_index = np.eye(4)
    T_lps_index[:3, :3] = matrix.reshape(3, 3).T * spacing
    T_lps_index[:3, 3] = origin
    T_lps_index[:3] *= _UNITS_MM[_one_of(header, "DistanceUnits", _UNITS_MM, "mm")]
    return T_lps_index


def _numbers(header: Mapping[str, str], names: tuple[str, ...], otherwise: FloatArray) -> FloatArray:
    for name in names:
        if name in header:
            words = header[name].split()
            if len(words) != len(otherwise):
                raise ValueError(f"{name} of {len(words)} numbers, not {len(otherwise)}")
            values = np.array(words, dtype=np.float64)
            if not (np.abs(values) < _FARTHEST_MM).all():
                raise ValueError(f"{name} is {header[name][:60]}")
            return values
    return otherwise


def _one_of(header: Mapping[str, str], name: str, known: Iterable[str], otherwise: str = "") -> str:
    value = header.get(name, otherwise)
    if value not in known:
        raise ValueError(f"{name} is {value[:40]!r}")
    return value


def _data(header: Mapping[str, str], behind: bytes, file: Path, most_bytes: int) -> bytes:
    name = header[_DATA]
    if name.upper() == "LOCAL":
        return behind
    if name.upper().startswith("LIST") or "%" in name:
        raise InputError(f"{file}: its slices lie in files of their own; write it as one file (.mha)")
    data = read_input(file.parent / name, most_bytes)
    skipped = int(header.get("HeaderSize", "0"))
    return data[skipped:] if skipped > 0 else data


def _unpacked(data: bytes, header: Mapping[str, str], size: int, file: Path) -> bytes:
    if header.get("CompressedData", "False").lower() != "true":
        return data[-size:] if header.get("HeaderSize") == "-1" else data[:size]
    try:
        return zlib.decompressobj().decompress(data, size)
    except zlib.error as error:
        raise InputError(f"{file}: its voxels cannot be unpacked ({error}); copy it again") from None
