"""Graded hexahedral meshes of a block.

The solution is singular along the rim of the grasp and the ends of the anchored faces, and nowhere else; there the
element size starts small and grows geometrically. Planes on which a boundary condition ends are mesh planes, so that
grasp and anchor are covered exactly. The gripped tissue moves rigidly and stores no energy: it is left out.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.experiment import Box
from estimator.fem.discretisation.elements import ElementKind
from estimator.fem.discretisation.mesh import Mesh

FloatArray = NDArray[np.float64]

_ORDER: dict[str, int] = {"hex8": 1, "hex27": 2, "hex64": 3}
# A box face this close to the block's face (as a share of the block's edge) means the block's face.
_SNAP = 0.02


@dataclass(frozen=True, slots=True)
class Grading:
    """Element sizes of a block mesh, m: at grasp and anchors, the largest, and the growth from one to the next."""

    grasp_m: float
    anchor_m: float
    largest_m: float
    growth: float
    layers: int


def block_mesh(
    size: FloatArray, anchors: tuple[Box, ...], grasp: Box, grading: Grading, kind: ElementKind = "hex27"
) -> Mesh:
    """Mesh a block centred at the origin, without the gripped tissue; a flat grasp grips a face and no tissue.

    Parameters
    ----------
    size : (3,) float64, edges of the block, m
    anchors, grasp : boxes whose content is fixed, or moves with the gripper; tissue frame at rest
    grading : element sizes
    kind : "hex8", "hex27" or "hex64"

    Raises
    ------
    InputError
        The grasp holds no tissue, or all of it.
    """
    half = np.asarray(size) / 2
    grasp_planes = snapped_to_block(grasp, half)
    anchor_planes = [snapped_to_block(box, half) for box in anchors]
    lines = [
        _graded_line(axis, half[axis], grasp_planes[:, axis], [a[:, axis] for a in anchor_planes], grading)
        for axis in range(2)
    ]
    lines.append(_layers(half[2], [grasp_planes[:, 2], *(a[:, 2] for a in anchor_planes)], grading.layers))
    mesh = structured_mesh(lines, kind)
    centres = mesh.points[mesh.cells].mean(axis=1)
    gripped = np.all((centres > grasp_planes[0]) & (centres < grasp_planes[1]), axis=1)
    # A glued plate grips the nodes of a face, and no tissue behind it.
    flat = np.count_nonzero(grasp_planes[0] == grasp_planes[1]) == 1
    if gripped.all() or not (gripped.any() or flat):
        raise InputError(
            "the grasp box must hold a part of the phantom, but not all of it; correct [grasp] box"
        )
    return _without(mesh, gripped)


def structured_mesh(lines: list[FloatArray], kind: ElementKind) -> Mesh:
    """Return the tensor-product mesh whose element boundaries along x, y, z are ``lines``."""
    order = _ORDER[kind]
    nodes = [_with_inner_nodes(line, order) for line in lines]
    counts = [len(n) for n in nodes]
    grid = np.stack(np.meshgrid(*nodes, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(grid)).reshape(counts)
    starts = [np.arange(len(line) - 1) * order for line in lines]
    local = np.arange(order + 1)
    cells = number[
        (starts[0][:, None, None, None, None, None] + local[:, None, None]),
        (starts[1][:, None, None, None, None] + local[:, None]),
        (starts[2][:, None, None, None] + local),
    ].reshape(-1, (order + 1) ** 3)
    return Mesh(grid, cells, kind)


def snapped_to_block(box: Box, half: FloatArray) -> FloatArray:
    """Return a box's corners (2, 3), its faces that lie beyond or just inside the block's moved onto them."""
    corners = np.clip(np.array([box.lower, box.upper]), -half, half)
    near = half - np.abs(corners) < _SNAP * half
    return np.where(near, np.sign(corners) * half, corners)


def _graded_line(
    axis: int, half: float, grasp: FloatArray, anchors: list[FloatArray], grading: Grading
) -> FloatArray:
    """Return element boundaries on [−half, half] that contain every plane on which a condition ends."""
    planes = {-half, half, *grasp.tolist()}
    fine = [(float(p), grading.grasp_m) for p in grasp]
    for lower, upper in anchors:
        planes |= {float(lower), float(upper)}
        if not (lower == -half and upper == half):
            fine += [(float(p), grading.anchor_m) for p in {lower, upper}]
    breaks = np.array(sorted(planes))

    def size_at(x: FloatArray) -> FloatArray:
        sizes = [h + (grading.growth - 1) * np.abs(x - p) for p, h in fine]
        return np.minimum(np.min(sizes, axis=0), grading.largest_m)

    pieces = [breaks[:1]]
    for start, stop in pairwise(breaks):
        x = np.linspace(start, stop, 2001)
        density = 1.0 / size_at(x)
        elements = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(x))])
        count = max(1, round(float(elements[-1])))
        pieces.append(np.interp(np.arange(1, count + 1) / count * elements[-1], elements, x))
    return np.concatenate(pieces)


def _layers(half: float, boxes: list[FloatArray], layers: int) -> FloatArray:
    breaks = np.unique([-half, half, *np.concatenate(boxes).tolist()])
    pieces = [breaks[:1]]
    for start, stop in pairwise(breaks):
        count = max(1, round(layers * (stop - start) / (2 * half)))
        pieces.append(np.linspace(start, stop, count + 1)[1:])
    return np.concatenate(pieces)


def _with_inner_nodes(line: FloatArray, order: int) -> FloatArray:
    fractions = np.arange(order) / order
    return np.append((line[:-1, None] + fractions * np.diff(line)[:, None]).ravel(), line[-1])


def _without(mesh: Mesh, dropped: NDArray[np.bool_]) -> Mesh:
    cells = mesh.cells[~dropped]
    used, renumbered = np.unique(cells, return_inverse=True)
    return Mesh(mesh.points[used], renumbered.reshape(cells.shape), mesh.kind)
