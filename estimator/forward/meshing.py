"""The mesh of an experiment, coarse or fine, and which of its nodes are held."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.experiment import Box, Experiment, PaintedPatch, Phantom
from estimator.experiment.holds import AXES, Axis, along
from estimator.experiment.support import stays_flat, thin_axis
from estimator.fem.boundary.patch import on_patch
from estimator.fem.boundary.problem import (
    FIDUCIAL_TOLERANCE_M,
    HeldNodes,
    RetractionProblem,
    retraction_problem,
)
from estimator.fem.discretisation.block_mesh import Grading, block_mesh, snapped_to_block
from estimator.fem.discretisation.elements import ElementKind
from estimator.fem.discretisation.mesh import Mesh
from estimator.forward.coarseness import thin_tissue_note
from estimator.forward.gradings import DEFAULT_GRADING, GRASP, SURFACE_GRADING, edge_lengths, usual_grading
from estimator.forward.prescribed import prescribed_motion
from estimator.forward.regions import with_regions
from estimator.geometry.grading import EdgeLengths
from estimator.geometry.holds import Region
from estimator.geometry.mesh_cache import tissue_mesh
from estimator.geometry.painted import painted_patch
from estimator.geometry.quality import quality_warnings
from estimator.geometry.tetrahedralise import TissueMesh, envelope_m
from estimator.surfaces.reading import read_surface
from estimator.surfaces.surface import Surface

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]
Mesher = Callable[[Surface, Mapping[str, Region], EdgeLengths], TissueMesh]

_ANCHOR, _ROLLER = "anchor", "roller"
# Of a sheet's thickness: nodes this near its middle plane lie in it.
_IN_MIDDLE = 1e-6


def mesh_experiment(
    experiment: Experiment, grading: Grading | None = None, kind: ElementKind = "hex27"
) -> RetractionProblem:
    """Mesh the phantom of an experiment and pose its retraction.

    Parameters
    ----------
    experiment : Experiment
    grading : element sizes of a block, from which those of a surface follow; by default an estimate's
    kind : element of a block; a surface is meshed with tet10

    Raises
    ------
    InputError
        Grasp or anchors hold no tissue, the surface cannot be read or meshed, or a fiducial lies off the tissue.
    """
    grading = grading or usual_grading(experiment)
    if experiment.phantom.surface is not None:
        read = read_surface(experiment.phantom.surface, experiment.phantom.unit)
        return surface_problem(experiment, read.surface, grading)
    half = np.asarray(experiment.phantom.size_m) / 2
    mesh = _meshed_block(experiment, grading, kind)
    fixed = np.zeros(len(mesh.points), dtype=bool)
    for anchor in experiment.anchors:
        fixed |= _inside(mesh.points, snapped_to_block(anchor, half))
    rollers = [
        (_inside(mesh.points, snapped_to_block(roller.box, half)), roller.directions)
        for roller in experiment.rollers
    ]
    if stays_flat(experiment):
        rollers.append((_in_middle(mesh, experiment.phantom), (AXES[thin_axis(experiment.phantom)],)))
    grasp = snapped_to_block(experiment.grasp.box, half)
    beads = experiment.fiducials_rest
    problem = retraction_problem(
        mesh,
        HeldNodes(
            fixed,
            _inside(mesh.points, grasp),
            _rolling(len(mesh.points), rollers),
            along(experiment.grasp.directions),
            prescribed_motion(experiment, mesh.points),
        ),
        np.asarray(experiment.grasp.centre),
        beads,
        _inside(beads, grasp) & _moves_rigidly(experiment),
    )
    return replace(problem, specific_weight=experiment.specific_weight)


def _meshed_block(experiment: Experiment, grading: Grading, kind: ElementKind) -> Mesh:
    """Mesh a block with every plane on which a condition ends, and with nodes in the middle plane of a flat sheet."""
    phantom, grasp = experiment.phantom, experiment.grasp.box
    size = np.asarray(phantom.size_m)
    held = (*experiment.anchors, *(one.box for one in experiment.directed))
    mesh = block_mesh(size, held, grasp, grading, kind)
    if not stays_flat(experiment) or _in_middle(mesh, phantom).any():
        return mesh
    upper = np.where(np.arange(3) == thin_axis(phantom), 0.0, size / 2)
    (x, y, z) = upper.tolist()
    return block_mesh(size, (*held, Box((-x, -y, -z), (x, y, z))), grasp, grading, kind)


def _moves_rigidly(experiment: Experiment) -> bool:
    """Tell whether what the gripper holds moves with it: not where it slides, or may be led by what was measured."""
    flat = any(low == high for low, high in zip(*_corners(experiment), strict=True))
    return not (experiment.grasp.slides or (experiment.prescribed and flat))


def _corners(experiment: Experiment) -> FloatArray:
    """Return the corners (2, 3) of what the gripper holds, m."""
    box = experiment.grasp.box
    if experiment.phantom.surface is not None:
        return np.array([box.lower, box.upper])
    return snapped_to_block(box, np.asarray(experiment.phantom.size_m) / 2)


def _in_middle(mesh: Mesh, phantom: Phantom) -> BoolArray:
    """Tell which nodes (n,) lie in the middle plane of a sheet."""
    thin = thin_axis(phantom)
    return np.asarray(np.abs(mesh.points[:, thin]) < _IN_MIDDLE * phantom.size_m[thin])


def _rolling(count: int, rollers: Sequence[tuple[BoolArray, tuple[Axis, ...]]]) -> BoolArray | None:
    """Tell of so many nodes along which axes (n, 3) rollers, given by their nodes (n,) and axes, hold them."""
    if not rollers:
        return None
    return np.any([np.outer(nodes, along(directions)) for nodes, directions in rollers], axis=0)


def held_regions(experiment: Experiment, surface: Surface) -> dict[str, Region]:
    """Return where the phantom is held: "anchor 1", "anchor 2", ..., "roller 1", ... and "grasp".

    Raises
    ------
    InputError
        The painting of a patch cannot be read.
    """
    anchors = {f"{_ANCHOR} {number}": box for number, box in enumerate(experiment.anchors, start=1)}
    rollers = {f"{_ROLLER} {number}": roller.box for number, roller in enumerate(experiment.rollers, start=1)}
    held = {**anchors, **rollers, GRASP: experiment.grasp.box}
    return {name: _region(box, surface) for name, box in held.items()}


def _region(held: Box, surface: Surface) -> Region:
    if isinstance(held, PaintedPatch):
        return painted_patch(surface, held.contains, held.spacing)
    return held


def surface_notes(experiment: Experiment, grading: Grading = SURFACE_GRADING) -> list[str]:
    """Return what is to be said of a surface, its mesh and its regions: what was repaired, and what is doubtful.

    Raises
    ------
    InputError
        As :func:`mesh_experiment` does.
    """
    if experiment.phantom.surface is None:
        return []
    read = read_surface(experiment.phantom.surface, experiment.phantom.unit)
    regions = held_regions(experiment, read.surface)
    lengths = edge_lengths(read.surface, regions, grading, experiment.phantom.regions)
    tissue = tissue_mesh(read.surface, regions, lengths)
    notes = [
        *read.repairs,
        *quality_warnings(tissue.quality, envelope_m(lengths), read.surface),
        *filter(None, [thin_tissue_note(tissue.mesh)]),
    ]
    stiffer = [
        f"{region.surface}: region {region.name} is taken as {region.modulus_ratio:g} times as stiff as the rest, "
        "whose parameters are told"
        for region in experiment.phantom.regions
    ]
    return [*(f"{experiment.phantom.surface}: {note}" for note in notes), *stiffer]


def surface_problem(
    experiment: Experiment,
    surface: Surface,
    grading: Grading = DEFAULT_GRADING,
    meshed: Mesher = tissue_mesh,
) -> RetractionProblem:
    """Mesh a surface with tetrahedra and pose the retraction that an experiment states.

    Raises
    ------
    InputError
        Grasp or anchors hold no tissue, the surface cannot be meshed, or a fiducial lies off the tissue.
    """
    regions = held_regions(experiment, surface)
    lengths = edge_lengths(surface, regions, grading, experiment.phantom.regions)
    tissue = meshed(surface, regions, lengths)
    _check_sliding_on_faces(experiment, tissue)
    anchors = [nodes for name, nodes in tissue.held.items() if name.startswith(_ANCHOR)]
    rollers = [
        (tissue.held[f"{_ROLLER} {number}"], roller.directions)
        for number, roller in enumerate(experiment.rollers, start=1)
    ]
    held = HeldNodes(
        np.any(anchors, axis=0) if anchors else np.zeros(len(tissue.mesh.points), dtype=bool),
        tissue.held[GRASP],
        _rolling(len(tissue.mesh.points), rollers),
        along(experiment.grasp.directions),
        prescribed_motion(experiment, tissue.mesh.points),
    )
    beads = experiment.fiducials_rest
    core = tissue.rigid.get(GRASP)
    # a bead on the surface lies off a coarse mesh of it by as much as that does
    off_mesh_m = FIDUCIAL_TOLERANCE_M + tissue.quality.deviation_m
    gripped = core.contains(beads) if core else on_patch(tissue.mesh, tissue.held[GRASP], beads, off_mesh_m)
    gripped &= _moves_rigidly(experiment)
    anchored = np.zeros(len(beads), dtype=bool)
    for name, box in tissue.rigid.items():
        anchored |= box.contains(beads) & (name != GRASP)
    problem = retraction_problem(
        tissue.mesh,
        held,
        np.asarray(experiment.grasp.centre),
        beads,
        gripped | anchored,
        off_mesh_m,
    )
    # Beads in rigid tissue have no place in the mesh. Those that an anchor holds then follow no node: they stay.
    posed = replace(
        problem,
        fiducials_gripped=gripped,
        specific_weight=experiment.specific_weight,
        grips_patch=core is None,
        grip_core=np.array([core.lower, core.upper]) if core else None,
    )
    return with_regions(posed, experiment.phantom.regions)


def _check_sliding_on_faces(experiment: Experiment, tissue: TissueMesh) -> None:
    for name in tissue.rigid:
        if name.startswith(_ROLLER) or (name == GRASP and experiment.grasp.slides):
            raise InputError(
                f"{name} holds some directions only, and its box reaches into the tissue; give it a flat box on a flat "
                "part of the surface, or a painted patch"
            )


def _inside(points: FloatArray, corners: FloatArray) -> BoolArray:
    margin = 1e-9
    return np.asarray(np.all((points > corners[0] - margin) & (points < corners[1] + margin), axis=1))
