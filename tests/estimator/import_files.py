"""One measurement, as other people's programs write it: the files that the tests of the import read."""

import csv
import multiprocessing
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import openpyxl
from numpy.typing import NDArray
from scipy.io import savemat

from estimator.experiment import Box, Grasp

FloatArray = NDArray[np.float64]

R_TISSUE_SOURCE = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
AXES = '["x", "-z", "y"]'
ORIGIN_MM = np.array([250.0, 40.0, -125.0])
SIZE = (0.06, 0.03, 0.01)
GRASP = Grasp(Box((0.018, -0.015, -0.005), (0.03, 0.015, 0.005)), (0.024, 0.0, 0.0))
RATE_HZ = 8.0
TORQUE_SHARE = 0.004  # m


@dataclass(frozen=True)
class Measurement:
    """What a laboratory measured, in its own axes (y up) and units (mm, mN), and the force that it puts on the tissue.

    All numbers are multiples of 1/64, which every format holds to the last digit.
    """

    time: FloatArray
    gripper_mm: FloatArray
    force_mn: FloatArray
    beads_mm: FloatArray

    @property
    def rows(self) -> int:
        return len(self.time)

    def tissue(self, points_mm: FloatArray) -> FloatArray:
        """Points in the tissue frame, m."""
        return 1e-3 * (points_mm - ORIGIN_MM) @ R_TISSUE_SOURCE.T

    @property
    def beads(self) -> FloatArray:
        return self.tissue(self.beads_mm)

    @property
    def position(self) -> FloatArray:
        """Of the gripper in the tissue frame, m, which starts at the grasp's centre."""
        return np.array(GRASP.centre) + 1e-3 * (self.gripper_mm - self.gripper_mm[0]) @ R_TISSUE_SOURCE.T

    @property
    def force(self) -> FloatArray:
        """Of the tissue on the gripper in the tissue frame, N."""
        return -1e-3 * (self.force_mn - self.force_mn[0]) @ R_TISSUE_SOURCE.T


def exact(values: Any) -> FloatArray:
    return np.round(np.asarray(values) * 64) / 64


def measurement(rows: int = 24, beads: int = 4) -> Measurement:
    """A pull along the tissue's x and a little up, after two rows at rest; the beads follow in part."""
    way = np.concatenate([[0.0, 0.0], np.linspace(0.0, 1.0, rows - 1)[1:]])
    moved = way[:, None] * np.array([6.0, 0.5, 0.0])
    rng = np.random.default_rng(2)
    rest = np.column_stack([rng.uniform(-25, 10, beads), np.full(beads, 5.0), rng.uniform(-12, 12, beads)])
    share = (rest[:, 0] + 30) / 54
    return Measurement(
        time=np.arange(rows) / RATE_HZ,
        gripper_mm=exact(ORIGIN_MM + np.array([24.0, 100.0, 0.0]) + moved),
        force_mn=exact(300.0 * moved),
        beads_mm=exact(ORIGIN_MM + rest + share[:, None] * moved[:, None]),
    )


def columns_of(one: Measurement) -> dict[str, FloatArray]:
    """Names with units, as a laboratory may choose them."""
    columns = {"Time (s)": one.time}
    columns |= {f"Position {axis} (mm)": one.gripper_mm[:, k] for k, axis in enumerate("xyz")}
    columns |= {f"F{axis} (mN)": one.force_mn[:, k] for k, axis in enumerate("xyz")}
    for bead in range(one.beads_mm.shape[1]):
        columns |= {f"M{bead}_{axis} (mm)": one.beads_mm[:, bead, k] for k, axis in enumerate("xyz")}
    return columns


def write_csv(one: Measurement, file: Path) -> None:
    columns = columns_of(one)
    with file.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(["Operator", "N. N."])
        writer.writerow(columns)
        writer.writerows(zip(*(values.tolist() for values in columns.values()), strict=True))


def write_german_csv(one: Measurement, file: Path) -> None:
    """Semicolons, decimal commas, a row of units, and a title line, in the encoding of Western Europe."""
    columns = columns_of(one)
    names = [name.partition(" (")[0] for name in columns]
    units = [name.partition(" (")[2].rstrip(")") for name in columns]
    lines = ["Prüfung: Retraktion", ";".join(names), ";".join(units)]
    lines += [
        ";".join(f"{value:.6f}".replace(".", ",") for value in row)
        for row in zip(*columns.values(), strict=True)
    ]
    file.write_bytes("\r\n".join([*lines, ""]).encode("cp1252"))


def write_xlsx(one: Measurement, file: Path) -> None:
    book = openpyxl.Workbook()
    book.active.title = "Notes"
    book.active.append(["phantom", "P07"])
    sheet = book.create_sheet("Data")
    columns = columns_of(one)
    sheet.append(list(columns))
    for row in zip(*(values.tolist() for values in columns.values()), strict=True):
        sheet.append(row)
    book.save(file)


def arrays_of(one: Measurement) -> dict[str, FloatArray]:
    return {"time": one.time, "position": one.gripper_mm, "force": one.force_mn, "beads": one.beads_mm}


def write_npz(one: Measurement, file: Path) -> None:
    np.savez(file, **arrays_of(one))


def write_hdf5(one: Measurement, file: Path) -> None:
    units = {"time": "s", "position": "mm", "force": "mN", "beads": "mm"}
    with h5py.File(file, "w") as store:
        for name, values in arrays_of(one).items():
            store.create_dataset(f"trial/{name}", data=values).attrs["units"] = units[name]


def write_mat5(one: Measurement, file: Path) -> None:
    savemat(file, {**arrays_of(one), "operator": "N. N.", "rate": RATE_HZ})


def write_mat73(one: Measurement, file: Path) -> None:
    """What MATLAB's ``save -v7.3`` writes: HDF5 behind a block of its own, every array transposed."""
    with h5py.File(file, "w", userblock_size=512) as store:
        for name, values in arrays_of(one).items():
            column = values[:, None] if values.ndim == 1 else values
            store.create_dataset(name, data=column.T).attrs["MATLAB_class"] = np.bytes_("double")
        note = store.create_dataset("operator", data=np.array([[ord(c)] for c in "N. N."], dtype=np.uint16))
        note.attrs["MATLAB_class"] = np.bytes_("char")
    _matlab_head(file)


def _matlab_head(file: Path) -> None:
    with file.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def write_c3d(one: Measurement, file: Path) -> None:
    """Three markers on the gripper, the beads, and the force as analog channels at four times the rate."""
    arms = np.array([[0.0, 0.0, 0.0], [16.0, 0.0, 0.0], [0.0, 0.0, 16.0]])
    gripper = one.gripper_mm[:, None] + arms
    write_markers(
        file,
        [*(f"grip{k}" for k in range(3)), *(f"bead{k}" for k in range(one.beads_mm.shape[1]))],
        np.concatenate([gripper, one.beads_mm], axis=1),
        ["Fx", "Fy", "Fz"],
        np.repeat(one.force_mn, 4, axis=0),
        "mN",
    )


def write_markers(
    file: Path,
    names: Sequence[str],
    points: FloatArray,
    channels: Sequence[str] = (),
    analog: FloatArray | None = None,
    unit: str = "N",
    trial: Mapping[str, list[int]] | None = None,
) -> None:
    """Markers (n, m, 3) in mm, NaN where one was hidden, and analog channels (k n, c)."""
    _of_its_own().submit(_write_markers, file, names, points, channels, analog, unit, trial).result()


@cache
def _of_its_own() -> ProcessPoolExecutor:
    """A process for ezc3d: in one with SimpleITK, which other tests use, it does not work."""
    return ProcessPoolExecutor(1, multiprocessing.get_context("spawn"))


def _write_markers(
    file: Path,
    names: Sequence[str],
    points: FloatArray,
    channels: Sequence[str],
    analog: FloatArray | None,
    unit: str,
    trial: Mapping[str, list[int]] | None,
) -> None:
    import ezc3d  # in that process alone

    capture = ezc3d.c3d()
    parameters = capture["parameters"]
    parameters["POINT"]["RATE"]["value"] = [RATE_HZ]
    parameters["POINT"]["LABELS"]["value"] = tuple(names)
    parameters["POINT"]["UNITS"]["value"] = ("mm",)
    capture.add_parameter("POINT", "X_SCREEN", ["+X"])
    capture.add_parameter("POINT", "Y_SCREEN", ["+Y"])
    for name, values in (trial or {}).items():
        capture.add_parameter("TRIAL", name, values)
    homogeneous = np.ones((4, points.shape[1], len(points)))
    homogeneous[:3] = np.moveaxis(points, (0, 1, 2), (2, 1, 0))
    capture["data"]["points"] = homogeneous
    if analog is not None:
        parameters["ANALOG"]["RATE"]["value"] = [RATE_HZ * (len(analog) // len(points))]
        parameters["ANALOG"]["LABELS"]["value"] = tuple(channels)
        parameters["ANALOG"]["UNITS"]["value"] = (unit,) * len(channels)
        capture["data"]["analogs"] = analog.T[None]
    capture.write(str(file))


@dataclass(frozen=True)
class Field:
    """Points (m, 2 or 3) of an image correlation, and how they move (n, m, 2 or 3), none in the first frame."""

    reference: FloatArray
    displacement: FloatArray


def field(dimensions: int, frames: int = 6) -> Field:
    x, y = (values.ravel() for values in np.meshgrid(np.arange(5.0) * 4, np.arange(4.0) * 4))
    reference = np.stack([x, y, np.zeros_like(x)][:dimensions], axis=1) + 8
    way = np.linspace(0, 1, frames)[:, None, None]
    return Field(reference, exact(way * 0.05 * reference))


def write_frames(folder: Path, one: Field, program: str) -> None:
    """A file for each frame, as a program exports it; numbers in the names without zeros in front."""
    folder.mkdir()
    for frame, moved in enumerate(one.displacement):
        name, header, rows = _PROGRAMS[program](one.reference, moved)
        with (folder / name.format(frame)).open("w", newline="", encoding="utf-8") as stream:
            stream.write(header)
            csv.writer(stream, delimiter=";" if program == "gom" else ",").writerows(rows.tolist())


def _dice(reference: FloatArray, moved: FloatArray) -> tuple[str, str, FloatArray]:
    count = len(reference)
    lost = np.zeros(count)
    rows = np.column_stack([np.arange(count), reference, moved, lost, lost + 0.01, lost + 4])
    header = "SUBSET_ID,COORDINATE_X,COORDINATE_Y,DISPLACEMENT_X,DISPLACEMENT_Y,SIGMA,GAMMA,STATUS_FLAG\n"
    return "DICe_solution_{}.txt", header, rows


def _vic3d(reference: FloatArray, moved: FloatArray) -> tuple[str, str, FloatArray]:
    rows = np.column_stack([reference, moved, np.zeros(len(reference))])
    header = '"X [mm]","Y [mm]","Z [mm]","U [mm]","V [mm]","W [mm]","sigma"\n'
    return "sheet-{}_0.csv", header, rows


def _matchid(reference: FloatArray, moved: FloatArray) -> tuple[str, str, FloatArray]:
    header = (
        "coor.X [mm],coor.Y [mm],coor.Z [mm],disp.Horizontal Displacement U [mm],disp.Vertical Displacement V [mm],"
        "disp.Out-Of-Plane: W [mm]\n"
    )
    return "image_{}.csv", header, np.column_stack([reference, moved])


def _gom(reference: FloatArray, moved: FloatArray) -> tuple[str, str, FloatArray]:
    """The coordinates are those of the deformed body."""
    rows = np.column_stack([np.arange(len(reference)), reference + moved, moved])
    return "Stage {}.csv", "# id;x [mm];y [mm];z [mm];dx [mm];dy [mm];dz [mm]\n", rows


def _mudic(reference: FloatArray, moved: FloatArray) -> tuple[str, str, FloatArray]:
    rows = np.column_stack([np.arange(len(reference)), reference + moved, moved, 0 * moved])
    return "fields{}.csv", "id,x,y,ux,uy,true_strain_xx,true_strain_yy\n", rows


_PROGRAMS = {"dice": _dice, "vic3d": _vic3d, "matchid": _matchid, "gom": _gom, "mudic": _mudic}


def write_mudic_npz(file: Path, one: Field, shape: tuple[int, int] = (4, 5)) -> None:
    """``coords`` and ``disp`` of its fields: (elements, 2, i, j, frames)."""
    grid = one.displacement.reshape(len(one.displacement), *shape, 2)
    moved = np.moveaxis(grid, (0, 3), (3, 0))[None]
    reference = np.moveaxis(one.reference.reshape(*shape, 2), 2, 0)[None, ..., None]
    np.savez(file, coords=reference + moved, disp=moved)


NCORR_SPACING, NCORR_MM = 3, 0.125


def ncorr_planes(one: Field, shape: tuple[int, int] = (4, 5)) -> tuple[list[FloatArray], list[FloatArray]]:
    """Displacements of the frames but the first, mm, on the image's grid of points."""
    grid = one.displacement[1:].reshape(-1, *shape, 2)
    return [plane[..., 0] for plane in grid], [plane[..., 1] for plane in grid]


def write_ncorr(file: Path, one: Field) -> None:
    u, v = ncorr_planes(one)
    displacements = np.array(
        [(a, b) for a, b in zip(u, v, strict=True)],
        dtype=[("plot_u_ref_formatted", object), ("plot_v_ref_formatted", object)],
    )
    info = {"spacing": NCORR_SPACING, "pixtounits": NCORR_MM, "units": "mm", "radius": 20}
    savemat(file, {"data_dic_save": {"displacements": displacements, "dispinfo": info}})


def write_ncorr73(file: Path, one: Field) -> None:
    """The same as MATLAB writes it in version 7.3: a struct array as references to arrays, transposed."""
    with h5py.File(file, "w", userblock_size=512) as store:
        saved = store.create_group("data_dic_save")
        kept = store.create_group("#refs#")
        info = saved.create_group("dispinfo")
        info["spacing"], info["pixtounits"] = [[float(NCORR_SPACING)]], [[NCORR_MM]]
        info.create_dataset("units", data=np.array([[ord(c)] for c in "mm"], dtype=np.uint16)).attrs[
            "MATLAB_class"
        ] = np.bytes_("char")
        fields = saved.create_group("displacements")
        for axis, planes in zip("uv", ncorr_planes(one), strict=True):
            references = [
                kept.create_dataset(f"{axis}{k}", data=plane.T).ref for k, plane in enumerate(planes)
            ]
            fields.create_dataset(
                f"plot_{axis}_ref_formatted", data=np.array([references], dtype=h5py.ref_dtype).T
            )
    _matlab_head(file)
