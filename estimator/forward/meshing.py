"""The mesh of an experiment, coarse or fine, and which of its nodes are held."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.experiment import Box, Experiment, PaintedPatch, Phantom, TissueRegion
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
from estimator.forward.prescribed import prescribed_motion
from estimator.forward.regions import ball_around, with_regions
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

# On the paper's block, force within 0.2 % and fiducials within 20 µm of the converged solution.
DEFAULT_GRADING = Grading(grasp_m=1e-3, anchor_m=3e-3, largest_m=12e-3, growth=2.0, layers=1)
# About a third of the default's error.
FINE_GRADING = Grading(grasp_m=0.5e-3, anchor_m=2e-3, largest_m=12e-3, growth=2.0, layers=2)
# About a fifth of the default's error, in E as in ν, which depends on how the tissue between grasp and anchor is
# meshed as much as on the rims: it measures the default's.
_MEASURING_GRADING = Grading(grasp_m=0.5e-3, anchor_m=1.5e-3, largest_m=12e-3, growth=1.6, layers=2)

# Tetrahedra shrink in all three directions towards a rim, hexahedra in one or two, so that the same size costs far
# more of them; layers of hexahedra refine one direction, for which tetrahedra refine all, but less. With these factors
# the default grading stays within 1 % in force on the paper's block, whose volume is this; larger phantoms get larger
# elements.
_TETRAHEDRON_AT_GRASP, _TETRAHEDRON_AT_ANCHOR, _TETRAHEDRON_GROWTH = 3.0, 2.0, 0.5
_TETRAHEDRON_BY_LAYERS = -0.5
_BLOCK_VOLUME_M3 = 1e-4
_ANCHOR, _ROLLER, _GRASP = "anchor", "roller", "grasp"
# Of a sheet's thickness: nodes this near its middle plane lie in it.
_IN_MIDDLE = 1e-6


def mesh_experiment(
    experiment: Experiment, grading: Grading = DEFAULT_GRADING, kind: ElementKind = "hex27"
) -> RetractionProblem:
    """Mesh the phantom of an experiment and pose its retraction.

    Parameters
    ----------
    experiment : Experiment
    grading : element sizes of a block; those of a surface follow from them and from the phantom's volume
    kind : element of a block; a surface is meshed with tet10

    Raises
    ------
    InputError
        Grasp or anchors hold no tissue, the surface cannot be read or meshed, or a fiducial lies off the tissue.
    """
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


def measuring_mesh(experiment: Experiment) -> RetractionProblem:
    """Pose the retraction on the mesh that a fit measures its discretisation error on.

    Raises
    ------
    InputError
        As :func:`mesh_experiment` does.
    """
    # Tetrahedra would pay three times the price for its gentler growth.
    of_block = experiment.phantom.surface is None
    return mesh_experiment(experiment, _MEASURING_GRADING if of_block else FINE_GRADING)


def held_regions(experiment: Experiment, surface: Surface) -> dict[str, Region]:
    """Return where the phantom is held: "anchor 1", "anchor 2", ..., "roller 1", ... and "grasp".

    Raises
    ------
    InputError
        The painting of a patch cannot be read.
    """
    anchors = {f"{_ANCHOR} {number}": box for number, box in enumerate(experiment.anchors, start=1)}
    rollers = {f"{_ROLLER} {number}": roller.box for number, roller in enumerate(experiment.rollers, start=1)}
    held = {**anchors, **rollers, _GRASP: experiment.grasp.box}
    return {name: _region(box, surface) for name, box in held.items()}


def _region(held: Box, surface: Surface) -> Region:
    if isinstance(held, PaintedPatch):
        return painted_patch(surface, held.contains, held.spacing)
    return held


def edge_lengths(
    surface: Surface, regions: Iterable[str], grading: Grading, stiffer: Sequence[TissueRegion] = ()
) -> EdgeLengths:
    """Return the edge lengths of tetrahedra that go with a block's grading.

    Parameters
    ----------
    surface : of the tissue
    regions : names of the held ones
    grading : of a block
    stiffer : regions of another stiffness, in which the edges are short enough for their size
    """
    scale = (surface.volume_m3 / _BLOCK_VOLUME_M3) ** (1 / 3)
    largest = grading.largest_m * grading.layers**_TETRAHEDRON_BY_LAYERS
    at_grasp, at_anchor = _TETRAHEDRON_AT_GRASP * grading.grasp_m, _TETRAHEDRON_AT_ANCHOR * grading.anchor_m
    rims = {name: scale * (at_grasp if name == _GRASP else at_anchor) for name in regions}
    coarser = largest / DEFAULT_GRADING.largest_m
    balls = tuple(dict.fromkeys(ball_around(region, coarser) for region in stiffer))
    return EdgeLengths(scale * largest, rims, _TETRAHEDRON_GROWTH * (grading.growth - 1.0), balls)


def surface_notes(experiment: Experiment, grading: Grading = DEFAULT_GRADING) -> list[str]:
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
        tissue.held[_GRASP],
        _rolling(len(tissue.mesh.points), rollers),
        along(experiment.grasp.directions),
        prescribed_motion(experiment, tissue.mesh.points),
    )
    beads = experiment.fiducials_rest
    core = tissue.rigid.get(_GRASP)
    # a bead on the surface lies off a coarse mesh of it by as much as that does
    off_mesh_m = FIDUCIAL_TOLERANCE_M + tissue.quality.deviation_m
    gripped = core.contains(beads) if core else on_patch(tissue.mesh, tissue.held[_GRASP], beads, off_mesh_m)
    gripped &= _moves_rigidly(experiment)
    anchored = np.zeros(len(beads), dtype=bool)
    for name, box in tissue.rigid.items():
        anchored |= box.contains(beads) & (name != _GRASP)
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
        if name.startswith(_ROLLER) or (name == _GRASP and experiment.grasp.slides):
            raise InputError(
                f"{name} holds some directions only, and its box reaches into the tissue; give it a flat box on a flat "
                "part of the surface, or a painted patch"
            )


def _inside(points: FloatArray, corners: FloatArray) -> BoolArray:
    margin = 1e-9
    return np.asarray(np.all((points > corners[0] - margin) & (points < corners[1] + margin), axis=1))
