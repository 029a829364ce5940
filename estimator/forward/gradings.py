"""How large the elements of a phantom are: those of a block as stated, those of a surface by its volume."""

from collections.abc import Iterable, Sequence

from estimator.experiment import Experiment, TissueRegion
from estimator.fem.discretisation.block_mesh import Grading
from estimator.forward.regions import ball_around
from estimator.geometry.grading import EdgeLengths
from estimator.surfaces.surface import Surface

# On the paper's block, force within 0.2 % and fiducials within 20 µm of the converged solution.
DEFAULT_GRADING = Grading(grasp_m=1e-3, anchor_m=3e-3, largest_m=12e-3, growth=2.0, layers=1)
# About a third of the default's error.
FINE_GRADING = Grading(grasp_m=0.5e-3, anchor_m=2e-3, largest_m=12e-3, growth=2.0, layers=2)
# About a fifth of the default's error, in E as in ν, which depends on how the tissue between grasp and anchor is
# meshed as much as on the rims: it measures the default's.
MEASURING_GRADING = Grading(grasp_m=0.5e-3, anchor_m=1.5e-3, largest_m=12e-3, growth=1.6, layers=2)

# Tetrahedra follow a curved skin by small elements, so that an organ has ten times the nodes of a block. Its error is
# measured on as many halves.
SURFACE_GRADING = Grading(grasp_m=2e-3, anchor_m=6e-3, largest_m=22e-3, growth=2.5, layers=1)

# Tetrahedra shrink in all three directions towards a rim, hexahedra in one or two, so that the same size costs far
# more of them; layers of hexahedra refine one direction, for which tetrahedra refine all, but less. With these factors
# the default grading stays within 1 % in force on the paper's block, whose volume is this; larger phantoms get larger
# elements.
_TETRAHEDRON_AT_GRASP, _TETRAHEDRON_AT_ANCHOR, _TETRAHEDRON_GROWTH = 3.0, 2.0, 0.5
_TETRAHEDRON_BY_LAYERS = -0.5
_BLOCK_VOLUME_M3 = 1e-4
GRASP = "grasp"
"""Name of what the gripper holds among the held regions."""


def usual_grading(experiment: Experiment) -> Grading:
    """Return the grading of the mesh on which an experiment is fitted."""
    return DEFAULT_GRADING if experiment.phantom.surface is None else SURFACE_GRADING


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
    rims = {name: scale * (at_grasp if name == GRASP else at_anchor) for name in regions}
    coarser = largest / DEFAULT_GRADING.largest_m
    balls = tuple(dict.fromkeys(ball_around(region, coarser) for region in stiffer))
    return EdgeLengths(scale * largest, rims, _TETRAHEDRON_GROWTH * (grading.growth - 1.0), balls)
