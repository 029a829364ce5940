"""Files that are imported from elsewhere, small ones, and the mapping that says what they hold.

MATLAB files are not among them: they are read in a process of its own, which the campaign takes for a program that a
file has started. tests/estimator/test_importing_refusals.py damages them.
"""

from collections.abc import Callable, Sequence
from pathlib import Path

import h5py
import numpy as np
import openpyxl
from numpy.typing import NDArray

from daq.bad_input.damage.any_file import BINARY, TEXT, Damage
from daq.bad_input.damage.value import TABLE, TOML
from daq.bad_input.kind import Kind
from estimator.importing.applying import experiment_of
from estimator.importing.formats.opening import read_source
from estimator.importing.mapping import read_mapping
from estimator.importing.proposal_text import text_of
from estimator.importing.proposing import propose

_ROWS = 12
_ANSWERS = (
    ("axis", '"x"'),
    ("shape", '"block"'),
    ("size", "[0.06, 0.03, 0.01]"),
    ("box", '"x+ 0.01"'),
    ("box", '"x-"'),
    ("surface_below", '"table"'),
    ("force_std", "0.01"),
)


def _arrays() -> dict[str, NDArray[np.float64]]:
    time = np.arange(_ROWS, dtype=np.float64)
    return {
        "time": time,
        "position": np.outer(time, [1.0, 0.0, 0.0]),
        "force": np.outer(time, [-0.4, 0.0, 0.0]),
    }


def _csv(folder: Path) -> None:
    rows = [f"{0.5 * row},{0.3 * row:.3f},{0.12 * row:.4f}" for row in range(_ROWS)]
    (folder / "trial.csv").write_text(
        "\n".join(["Time (s),Extension (mm),Load (N)", *rows, ""]), encoding="utf-8"
    )


def _xlsx(folder: Path) -> None:
    book = openpyxl.Workbook()
    book.active.append(["Time (s)", "Extension (mm)", "Load (N)"])
    for row in range(_ROWS):
        book.active.append([0.5 * row, 0.3 * row, 0.12 * row])
    book.save(folder / "trial.xlsx")


def _npz(folder: Path) -> None:
    np.savez(folder / "trial.npz", **_arrays())  # type: ignore[arg-type] # names are no options of it


def _hdf5(folder: Path) -> None:
    with h5py.File(str(folder / "trial.h5"), "w") as store:
        for name, values in _arrays().items():
            store[f"trial/{name}"] = values


def _frames(folder: Path) -> None:
    header = "SUBSET_ID,COORDINATE_X,COORDINATE_Y,DISPLACEMENT_X,DISPLACEMENT_Y,SIGMA"
    (folder / "frames").mkdir()
    for frame in range(3):
        rows = [f"{k},{10.0 * k},{20.0 * (k % 2)},{0.1 * k * frame:.4f},0.0,0.0" for k in range(6)]
        file = folder / "frames" / f"DICe_solution_{frame}.txt"
        file.write_text("\n".join([header, *rows, ""]), encoding="utf-8")


def _mapped(folder: Path) -> None:
    """Write a source and a mapping in which nothing is left open."""
    _csv(folder)
    text = text_of(propose(read_source(folder / "trial.csv")), Path("trial"))
    for key, value in _ANSWERS:
        text = text.replace(f'{key} = "?"', f"{key} = {value}", 1)
    (folder / "trial.import.toml").write_text(text, encoding="utf-8")


def _kind(name: str, file: str, write: Callable[[Path], None], damages: Sequence[Damage]) -> Kind:
    return Kind(
        f"import, {name}",
        write,
        {file: damages},
        # what is read is understood as well
        read=lambda folder: text_of(propose(read_source(folder / file.partition("/")[0])), Path("trial")),
    )


KINDS: tuple[Kind, ...] = (
    _kind("CSV", "trial.csv", _csv, (*TEXT, *TABLE)),
    _kind("XLSX", "trial.xlsx", _xlsx, BINARY),
    _kind("NPZ", "trial.npz", _npz, BINARY),
    _kind("HDF5", "trial.h5", _hdf5, BINARY),
    _kind("frames", "frames/DICe_solution_1.txt", _frames, (*TEXT, *TABLE)),
    Kind(
        "import, mapping",
        _mapped,
        {"trial.import.toml": (*TEXT, *TOML)},
        read=lambda folder: experiment_of(
            read_source(folder / "trial.csv"), read_mapping(folder / "trial.import.toml"), folder
        ),
    ),
)
