"""Reads cases: folders of experiments as docs/experiments.md describes them."""

import csv
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

FloatArray = NDArray[np.float64]

WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")


@dataclass(frozen=True)
class Experiment:
    """One retraction, SI units, in the tissue frame; n rows, m beads.

    Attributes
    ----------
    size : edges of the body's bounding box, m; it is centred on the origin
    is_block : whether the body is that box
    anchors, grasp : boxes (2, 3) of tissue that stands still, and that moves with the gripper
    centre : of the gripper's frame at rest, m
    order : of the experiments on one mounting
    phase : ramp, hold, return or return_hold, of each row
    motion : (n, 6) of the gripper from rest: way, m, and rotation vector
    wrench : (n, 6) that the tissue exerts on the gripper; NaN where it was not measured
    beads : (n, m, 3) way of each bead from rest, m; NaN where it was not measured
    wrench_std, beads_std : (6,) and (3,) standard deviations of the noise
    """

    name: str
    size: tuple[float, float, float]
    is_block: bool
    anchors: tuple[FloatArray, ...]
    grasp: FloatArray
    centre: FloatArray
    order: int
    time: FloatArray
    phase: NDArray[np.str_]
    motion: FloatArray
    wrench: FloatArray
    rest: FloatArray
    beads: FloatArray
    wrench_std: FloatArray
    beads_std: FloatArray


def read_case(folder: Path) -> list[Experiment]:
    """Read all experiments of a case, in the order in which they were carried out."""
    found = [_read_experiment(file.parent) for file in sorted(folder.glob("*/experiment.toml"))]
    return sorted(found, key=lambda one: one.order)


def case_folders(folder: Path) -> list[Path]:
    """Return the folders of the cases of a set."""
    return sorted({file.parents[1] for file in folder.glob("*/*/experiment.toml")})


def _read_experiment(folder: Path) -> Experiment:
    told = tomllib.loads((folder / "experiment.toml").read_text(encoding="utf-8"))
    with (folder / "observations.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    rest = np.array(told["fiducials"]["rest"], dtype=np.float64).reshape(-1, 3)
    boxes = [np.array(anchor["box"]) for anchor in told["anchor"] if "box" in anchor]
    grasp = np.array(told["grasp"]["box"])
    quaternion = _columns(rows, ("qx", "qy", "qz", "qw"))
    position = _columns(rows, ("px", "py", "pz"))
    centre = np.array(told["grasp"]["centre"])
    names = [f"m{bead:02d}{axis}" for bead in range(len(rest)) for axis in "xyz"]
    beads = _columns(rows, tuple(names)).reshape(len(rows), -1, 3) if names else np.empty((len(rows), 0, 3))
    sensor = told["sensor"]
    size = told["phantom"].get("size") or tuple(np.ptp(np.vstack([*boxes, grasp]), axis=0))
    return Experiment(
        name=told["name"],
        size=(float(size[0]), float(size[1]), float(size[2])),
        is_block=told["phantom"]["shape"] == "block",
        anchors=tuple(boxes),
        grasp=grasp,
        centre=centre,
        order=told["order"],
        time=_columns(rows, ("time",))[:, 0],
        phase=np.array([row["phase"] for row in rows]),
        motion=np.hstack([position - centre, Rotation.from_quat(quaternion).as_rotvec()]),
        wrench=_columns(rows, WRENCH),
        rest=rest,
        beads=beads - rest,
        wrench_std=np.repeat([sensor["force_std"], sensor["torque_std"]], 3),
        beads_std=np.full(3, sensor["fiducial_std"]),
    )


def _columns(rows: list[dict[str, str]], names: tuple[str, ...]) -> FloatArray:
    """Return columns of a table (n, k), NaN where a field is empty or a column is missing."""
    return np.array([[float(row.get(name) or "nan") for name in names] for row in rows]).reshape(
        len(rows), len(names)
    )
