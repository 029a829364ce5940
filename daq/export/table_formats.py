"""Writing tables with their units as CSV, Parquet, HDF5 or NPZ.

CSV and Parquet are folders with one file a table: units stand in the CSV header as ``fx (N)`` and in the metadata of a
Parquet column. HDF5 has a group a table whose datasets carry the attribute ``units``. NPZ has an array
``table/column`` for every column and the units of a table, in the order of its columns, in ``table/units``.
"""

import csv
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from daq.export.stream_tables import Column, Table

Write = Callable[[Sequence[Table], Path], None]


def write_csv(tables: Sequence[Table], folder: Path) -> None:
    """Write one CSV file a table into a new folder."""
    folder.mkdir()
    for table in tables:
        with (folder / f"{table.name}.csv").open("w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow([_header(column) for column in table.columns])
            writer.writerows(zip(*(_fields(column) for column in table.columns), strict=True))


def write_parquet(tables: Sequence[Table], folder: Path) -> None:
    """Write one Parquet file a table into a new folder."""
    import pyarrow as pa  # 36 MB, which others than those who write this format need not wait for
    import pyarrow.parquet as pq

    folder.mkdir()
    for table in tables:
        fields, arrays = [], []
        for column in table.columns:
            array = pa.array(column.values)
            fields.append(pa.field(column.name, array.type, metadata={"units": column.unit}))
            arrays.append(array)
        pq.write_table(pa.table(arrays, schema=pa.schema(fields)), folder / f"{table.name}.parquet")


def write_hdf5(tables: Sequence[Table], file: Path) -> None:
    """Write one HDF5 file with a group a table."""
    import h5py

    with h5py.File(str(file), "w") as store:
        for table in tables:
            group = store.create_group(table.name)
            for column in table.columns:
                values = column.values
                if values.dtype.kind == "U":
                    dataset = group.create_dataset(
                        column.name, data=values.astype(object), dtype=h5py.string_dtype()
                    )
                else:
                    dataset = group.create_dataset(column.name, data=values)
                dataset.attrs["units"] = column.unit


def write_npz(tables: Sequence[Table], file: Path) -> None:
    """Write one compressed NPZ file."""
    arrays = {f"{table.name}/{column.name}": column.values for table in tables for column in table.columns}
    units = {f"{table.name}/units": np.array([column.unit for column in table.columns]) for table in tables}
    with file.open("wb") as stream:
        np.savez_compressed(stream, allow_pickle=False, **arrays, **units)


FORMATS: Mapping[str, Write] = {
    "csv": write_csv,
    "parquet": write_parquet,
    "hdf5": write_hdf5,
    "npz": write_npz,
}


def _header(column: Column) -> str:
    return column.name if column.unit in ("1", "text") else f"{column.name} ({column.unit})"


def _fields(column: Column) -> list[object]:
    """Return the fields of a column; an unknown number is an empty field."""
    values: list[object] = column.values.tolist()
    # NaN alone differs from itself
    return ["" if value != value else value for value in values]
