"""``retract mesh``: mesh a phantom given as a surface, and tell how good the mesh is; or check and convert a mesh."""

import argparse
import time
from dataclasses import asdict, replace
from pathlib import Path

from daq.cli.verb import Result, Verbs, add_verb, progress
from estimator.errors import InputError
from estimator.experiment import Experiment, read_experiment
from estimator.forward.gradings import DEFAULT_GRADING, edge_lengths
from estimator.forward.meshing import held_regions
from estimator.geometry.mesh_cache import tissue_mesh
from estimator.geometry.quality import quality_warnings
from estimator.geometry.tetrahedralise import TissueMesh, envelope_m
from estimator.meshes.outside import outer_surface
from estimator.meshes.reading import is_volume_mesh, read_volume_mesh, volume_m3
from estimator.meshes.volume_mesh import VolumeMesh
from estimator.meshes.writing import check_mesh_name, volume_mesh_of, write_mesh
from estimator.report.drawing.mesh_picture import draw_mesh
from estimator.surfaces.reading import read_surface
from estimator.surfaces.surface import Surface
from estimator.surfaces.units import UNITS, Unit
from estimator.surfaces.writing import write_ply

_EXAMPLES = """  retract mesh liver.stl
  retract mesh liver.ply --unit mm --strict
  retract mesh experiments/liver_pull --edge-length 0.01 -o runs/liver.vtu
  retract mesh abaqus.inp -o liver.feb       check a mesh, put it in order, and convert it
  retract mesh salome.med --unit mm --surface liver.ply

Surfaces come as STL, PLY, OBJ or VTP, volume meshes as MSH 2.2 or 4.1, VTU, INP (Abaqus, CalculiX) or MED."""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(
        verbs,
        "mesh",
        "mesh a phantom given as a closed surface, or check and convert a volume mesh",
        _EXAMPLES,
        run,
    )
    parser.add_argument(
        "phantom",
        type=Path,
        metavar="SURFACE|MESH|EXPERIMENT",
        help="file of a surface or a volume mesh, told by its content, or an experiment folder with a surface",
    )
    parser.add_argument(
        "--unit",
        choices=UNITS,
        help="of a file (default: metres, or millimetres where only these give a phantom)",
    )
    parser.add_argument(
        "--strict", action="store_true", help="refuse what would have to be repaired, and say how"
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
        metavar="OUT",
        help="file to write: .vtu, .msh, .inp or .feb; of a surface with a picture OUT.png beside it (default: "
        "NAME_mesh.vtu here)",
    )
    parser.add_argument(
        "--surface",
        type=Path,
        metavar="OUT.ply",
        help="write the surface of a volume mesh, and OUT_NAME.ply for each region that is not all of it",
    )


def run(options: argparse.Namespace) -> Result:
    """Mesh, write mesh and picture, and tell the quality."""
    target = options.output or Path(f"{options.phantom.resolve().stem}_mesh.vtu")
    check_mesh_name(target)
    if not options.phantom.is_dir() and is_volume_mesh(options.phantom):
        return _converted(options, target)
    if options.surface is not None:
        raise InputError(
            f"{options.phantom}: --surface is for volume meshes, and this is a surface; leave it out"
        )
    started = time.perf_counter()
    file, unit, experiment = _phantom(options.phantom, options.unit)
    read = read_surface(file, unit)
    regions = {} if experiment is None else held_regions(experiment, read.surface)
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
    write_mesh(volume_mesh_of(tissue.mesh, tissue.held), target)
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


def _converted(options: argparse.Namespace, target: Path) -> Result:
    """Write a volume mesh once all of its elements are in order."""
    if options.edge_length is not None:
        raise InputError(f"{options.phantom}: is a mesh already; --edge-length is for surfaces: leave it out")
    read = read_volume_mesh(options.phantom, options.unit)
    if options.strict and read.repairs:
        raise InputError(
            f"{options.phantom}: {'; '.join(read.repairs)}; mend it where it was made, or leave --strict out"
        )
    mesh, volume = read.mesh, volume_m3(read.mesh)
    surfaces = _surfaces(mesh, options) if options.surface is not None else {}
    write_mesh(mesh, target)
    for file, surface in surfaces.items():
        write_ply(surface, file)
    files = [str(target), *map(str, surfaces)]
    sizes = {name: int(sum(one.sum() for one in inside.values())) for name, inside in mesh.regions.items()}
    lines = [
        mesh.describe(),
        f"volume           {volume * 1e6:.3f} cm3",
        *(f"region           {name}: {count} elements" for name, count in sizes.items()),
        *(f"nodes            {name}: {int(nodes.sum())}" for name, nodes in mesh.node_sets.items()),
        *(f"repaired         {repair}" for repair in read.repairs),
        *(f"Note: {one}" for one in read.left_out),
        f"written          {', '.join(files)}",
    ]
    data = {
        "elements": {kind: len(cells) for kind, cells in mesh.blocks.items()},
        "nodes": len(mesh.points),
        "volume_m3": volume,
        "regions": sizes,
        "node_sets": {name: int(nodes.sum()) for name, nodes in mesh.node_sets.items()},
        "repairs": list(read.repairs),
        "left_out": list(read.left_out),
        "files": files,
    }
    return Result("\n".join(lines), data)


def _surfaces(mesh: VolumeMesh, options: argparse.Namespace) -> dict[Path, Surface]:
    """Return the surfaces of a mesh and of its regions, by the file to write each to."""
    if options.surface.suffix.lower() != ".ply":
        raise InputError(f"{options.surface}: surfaces are written as PLY; give a name that ends with .ply")
    found = {options.surface: outer_surface(mesh, str(options.phantom)).surface}
    for name in mesh.regions:
        if sum(one.sum() for one in mesh.regions[name].values()) < mesh.elements:
            file = options.surface.with_name(f"{options.surface.stem}_{name}.ply")
            found[file] = outer_surface(mesh, f"{options.phantom}: region {name}", name).surface
    return found


def _phantom(path: Path, unit: Unit | None) -> tuple[Path, Unit | None, Experiment | None]:
    """Return the surface file and its unit, and the experiment that it is of."""
    if not path.is_dir():
        return path, unit, None
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
    return experiment.phantom.surface, experiment.phantom.unit, experiment


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
