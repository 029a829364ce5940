"""Writes a phantom's folder: surfaces in metres, and a file that states the phantom and where it comes from."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimator.experiment.model import Phantom, TissueRegion
from estimator.experiment.reading import PHANTOM_FORMAT
from estimator.experiment.toml_values import toml_number, toml_text, toml_vector
from estimator.experiment.writing import phantom_lines
from estimator.segmentation.phantom import SegmentedPhantom
from estimator.segmentation.registration import Registration
from estimator.surfaces.writing import write_ply

FloatArray = NDArray[np.float64]

PHANTOM_FILE = "phantom.toml"


@dataclass(frozen=True, eq=False)
class Origin:
    """Where a phantom comes from.

    Attributes
    ----------
    segmentation : file
    frame : of the phantom, in words
    T_phantom_lps : (4, 4) float64, from the image's physical frame (LPS) to the phantom's, m
    registration : to the tissue frame; None where there was none
    """

    segmentation: Path
    frame: str
    T_phantom_lps: FloatArray
    registration: Registration | None


def write_phantom(
    found: SegmentedPhantom, beads: FloatArray, origin: Origin, density: float, folder: Path
) -> None:
    """Write surfaces and ``phantom.toml`` into a folder; beads are (m, 3) at rest, m."""
    folder.mkdir(parents=True, exist_ok=True)
    write_ply(found.surface, folder / "phantom.ply")
    regions = tuple(
        TissueRegion(name, folder / f"{name}.ply", found.modulus_ratios[name], "m") for name in found.regions
    )
    for region in regions:
        write_ply(found.regions[region.name], folder / region.file_name)
    x, y, z = np.ptp(found.surface.bounds, axis=0).tolist()
    phantom = Phantom("surface", (x, y, z), folder / "phantom.ply", density, "m", regions)
    rest = [f"    {toml_vector((x, y, z))}," for x, y, z in beads.tolist()]
    lines = [
        f"format = {toml_text(PHANTOM_FORMAT)}",
        "",
        *phantom_lines(phantom),
        *(["", "[fiducials]", "rest = [", *rest, "]"] if rest else []),
        "",
        "[image]",
        f"segmentation = {toml_text(origin.segmentation.name)}",
        f"frame = {toml_text(origin.frame)}",
        f"T_phantom_lps = [{', '.join(_row(row) for row in origin.T_phantom_lps.tolist())}]",
        f"voxels_m3 = {toml_number(found.voxels_m3)}",
        f"volume_error = {toml_number(found.volume_error)}",
        *_registration(origin.registration),
    ]
    (folder / PHANTOM_FILE).write_text("\n".join(lines) + "\n", encoding="utf-8")


def _registration(made: Registration | None) -> list[str]:
    if made is None:
        return []
    left_out = made.left_out_m[np.isfinite(made.left_out_m)]
    return [
        "",
        "[registration]",
        f"method = {toml_text(made.method)}",
        f"points = {len(made.points)}",
        f"rms_m = {toml_number(made.rms_m)}",
        f"largest_m = {toml_number(made.distances_m.max())}",
        *([f"left_out_rms_m = {toml_number(np.sqrt(np.mean(left_out**2)))}"] if len(left_out) else []),
    ]


def _row(values: list[float]) -> str:
    return f"[{', '.join(map(toml_number, values))}]"
