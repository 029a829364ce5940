"""``retract mesh``: mesh a phantom given as a surface, and tell how good the mesh is."""

import argparse
import time
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path

from daq.cli.verb import Result, Verbs, add_verb, progress
from estimator.errors import InputError
from estimator.experiment import read_experiment
from estimator.forward.meshing import DEFAULT_GRADING, edge_lengths, held_regions
from estimator.geometry.holds import Region
from estimator.geometry.mesh_cache import tissue_mesh
from estimator.geometry.quality import quality_warnings
from estimator.geometry.tetrahedralise import TissueMesh, envelope_m
from estimator.geometry.vtu import write_vtu
from estimator.report.drawing.mesh_picture import draw_mesh
from estimator.surfaces.reading import read_surface
from estimator.surfaces.units import UNITS, Unit

_EXAMPLES = """  retract mesh liver.stl
  retract mesh liver.ply --unit mm --strict
  retract mesh experiments/liver_pull --edge-length 0.01 -o runs/liver.vtu"""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "mesh", "mesh a phantom given as a closed surface", _EXAMPLES, run)
    parser.add_argument(
        "phantom",
        type=Path,
        metavar="SURFACE|EXPERIMENT",
        help="STL, PLY, OBJ or VTP file, told by its content, or an experiment folder with one",
    )
    parser.add_argument(
        "--unit",
        choices=UNITS,
        help="of a surface file (default: metres, or millimetres where only these give a phantom)",
    )
    parser.add_argument(
        "--strict", action="store_true", help="refuse a surface that would have to be repaired, and say how"
    )
    parser.add_argument(
        "--edge-length",
        type=float,
        metavar="M",
        help="largest edge length (default: by the phantom's volume)",
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="OUT.vtu",
        help="file to write, with a picture OUT.png beside it (default: NAME_mesh.vtu here)",
    )


def run(options: argparse.Namespace) -> Result:
    """Mesh, write mesh and picture, and tell the quality."""
    started = time.perf_counter()
    file, unit, regions = _phantom(options.phantom, options.unit)
    target = options.output or Path(f"{options.phantom.resolve().stem}_mesh.vtu")
    if target.suffix != ".vtu":
        raise InputError(f"{target}: the mesh is written as VTU; give a name that ends with .vtu")
    read = read_surface(file, unit)
    if options.strict and read.repairs:
        raise InputError(
            f"{file}: {'; '.join(read.repairs)}; mend it where it was made, or leave --strict out to have that done"
        )
    surface = read.surface
    lengths = edge_lengths(surface, regions, DEFAULT_GRADING)
    if options.edge_length is not None:
        lengths = replace(lengths, largest_m=options.edge_length)
    with progress() as tell:
        tell("meshing", 0, 1)
        tissue = tissue_mesh(surface, regions, lengths)
    seconds = time.perf_counter() - started
    write_vtu(tissue.mesh, tissue.held, target)
    draw_mesh(tissue.mesh, tissue.held, target.with_suffix(".png"))
    warnings = quality_warnings(tissue.quality, envelope_m(lengths), surface)
    notes = [
        *(f"repaired         {repair}" for repair in read.repairs),
        *(f"Warning: {one}" for one in warnings),
    ]
    return Result(
        "\n".join([_describe(tissue, target, seconds), *notes]),
        {
            "mesh": tissue.mesh.describe(),
            "quality": asdict(tissue.quality),
            "repairs": list(read.repairs),
            "warnings": warnings,
            "files": [str(target), str(target.with_suffix(".png"))],
            "seconds": seconds,
        },
    )


def _phantom(path: Path, unit: Unit | None) -> tuple[Path, Unit | None, Mapping[str, Region]]:
    """Return the surface file and its unit, and where an experiment holds it."""
    if not path.is_dir():
        return path, unit, {}
    if unit is not None:
        raise InputError(
            f'{path}: --unit is for a surface file; write unit = "{unit}" under [phantom] of its experiment.toml'
        )
    experiment = read_experiment(path)
    if experiment.phantom.surface is None:
        raise InputError(
            f"{path}: its phantom is a block, which is meshed with hexahedra as it is needed; "
            "give an experiment whose phantom is a surface, or a surface file"
        )
    return experiment.phantom.surface, experiment.phantom.unit, held_regions(experiment)


def _describe(tissue: TissueMesh, target: Path, seconds: float) -> str:
    quality, mesh = tissue.quality, tissue.mesh
    (flattest, bluntest), (worst, mean) = quality.dihedral_deg, quality.radius_ratio
    lines = [
        f"{len(mesh.cells)} quadratic tetrahedra, {len(mesh.points)} nodes; {seconds:.1f} s",
        f"volume           {quality.volume_m3 * 1e6:.3f} cm3 ({100 * quality.volume_error:+.2f} % of the surface's)",
        f"dihedral angles  {flattest:.1f} to {bluntest:.1f} degrees",
        f"radius ratio     {worst:.2f} at worst, {mean:.2f} on average (1: regular)",
        f"off the surface  {quality.off_surface_m * 1e3:.2f} mm at most; "
        f"the surface off the mesh {quality.missed_m * 1e3:.2f} mm",
        *(f"{name:16} {100 * covered:.1f} % covered" for name, covered in quality.covered.items()),
        f"written          {target}, {target.with_suffix('.png')}",
    ]
    return "\n".join(lines)
