"""The input deck of CalculiX: one file an experiment, a step for every load step of its motion.

Nodes and elements are numbered from 1. CalculiX has no hexahedron of 27 nodes: ours go over without the nodes in the
middles of faces and of the element, as ``C3D20R``, whose eight integration points do not lock near ν = 1/2.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.fem.discretisation.mesh import Mesh
from estimator.handover.calculix.law import Card, card_of
from estimator.handover.model import HandedOver, Run
from estimator.materials.material import make_material

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# Corners as Abaqus numbers them, then the middles of the edges below, above and between, in steps of half an element.
_CORNERS = ((0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2))
_EDGES = (
    *((1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0)),
    *((1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2)),
    *((0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)),
)
_OURS = {place: number for number, place in enumerate(product(range(3), repeat=3))}
_HEXAHEDRON = [_OURS[place] for place in (*_CORNERS, *_EDGES)]
# VTK's order, which is ours, is that of C3D10.
_TETRAHEDRON = list(range(10))
_KINDS = {"hex27": ("C3D20R", _HEXAHEDRON), "tet10": ("C3D10", _TETRAHEDRON)}
# Stiffnesses of elements that differ by less, as a share, are one material.
_ONE_MATERIAL = 0.01
# A spring between two directions that is weaker than the others by this factor is none.
_NO_COUPLING = 1e-6
_AXES = (1, 2, 3)
# CalculiX ends its iterations at a residual of 0.5 % and a correction of 1 % unless it is told otherwise, which leaves
# beads a tenth of a millimetre off: largest residual, largest correction, and what of both counts as none.
_CONVERGED = "1.e-6, 1.e-5, , , 1.e-5, 1.e-8, 1.e-5, 1.e-8"


@dataclass(frozen=True)
class Numbering:
    """Nodes (u,) of our mesh that CalculiX has, in the order of its numbers from 1, and its elements (e, k)."""

    element: str
    nodes: IntArray
    cells: IntArray

    @property
    def of_node(self) -> dict[int, int]:
        """CalculiX's number of each of our nodes."""
        return {int(node): number for number, node in enumerate(self.nodes, start=1)}


def numbering_of(mesh: Mesh) -> Numbering:
    """Return how a mesh goes over.

    Raises
    ------
    InputError
        Its elements have no counterpart.
    """
    if mesh.kind not in _KINDS:
        raise InputError(f"CalculiX has no counterpart of {mesh.kind}; mesh with {' or '.join(_KINDS)}")
    element, order = _KINDS[mesh.kind]
    cells = mesh.cells[:, order]
    return Numbering(element, np.unique(cells), cells)


def deck_of(handed: HandedOver, run: Run) -> str:
    """Return the input deck of an experiment.

    Raises
    ------
    InputError
        Springs of an anchor are not along the axes.
    """
    return "".join(f"{line}\n" for line in _lines(handed, run))


def _lines(handed: HandedOver, run: Run) -> Iterator[str]:
    problem, numbering = handed.problem, numbering_of(handed.problem.body.mesh)
    of_node = numbering.of_node
    points = problem.body.mesh.points
    yield from (
        "*HEADING",
        f"{run.experiment.phantom_id}, {run.experiment.name}; m, N, Pa",
        "*NODE, NSET=TISSUE",
    )
    for number, node in enumerate(numbering.nodes, start=1):
        yield f"{number}, " + ", ".join(f"{x:.12g}" for x in points[node])
    yield f"*ELEMENT, TYPE={numbering.element}, ELSET=BODY"
    for number, cell in enumerate(numbering.cells, start=1):
        fields = [number, *(of_node[int(node)] for node in cell)]
        yield ", ".join(map(str, fields[:11])) + ("," if len(fields) > 11 else "")
        if len(fields) > 11:
            yield ", ".join(map(str, fields[11:]))
    held = [of_node[int(n)] for n in numbering.nodes if problem.fixed[n]]
    gripped = [int(n) for n in numbering.nodes if problem.gripped[n]]
    if held:
        yield from ("*NSET, NSET=ANCHORS", *(f"{number}," for number in held))
    yield from ("*NSET, NSET=GRASP", *(f"{of_node[node]}," for node in gripped))
    yield from _materials(handed)
    yield from _springs(handed, numbering)
    if held:
        yield from ("*BOUNDARY", "ANCHORS, 1, 3")
    for step, pose in enumerate(run.poses):
        target = problem.gripped_positions(pose) - points[problem.gripped]
        moved = dict(zip(np.flatnonzero(problem.gripped).tolist(), target, strict=True))
        yield from ("*STEP, NLGEOM, INC=1000", "*CONTROLS, PARAMETERS=FIELD", _CONVERGED)
        yield from ("*STATIC", "0.5, 1., 1.e-5, 1.", "*BOUNDARY")
        for node in gripped:
            for axis in _AXES:
                yield f"{of_node[node]}, {axis}, {axis}, {moved[node][axis - 1]:.12g}"
        if step == 0:
            yield from _loads(handed, numbering)
        yield from ("*NODE PRINT, NSET=TISSUE, FREQUENCY=100000", "U")
        yield from ("*NODE PRINT, NSET=GRASP, FREQUENCY=100000", "RF", "*END STEP")


def _materials(handed: HandedOver) -> Iterator[str]:
    """Write a material for every stiffness that occurs."""
    level = np.round(np.log(handed.stiffness) / np.log1p(_ONE_MATERIAL)).astype(int)
    for number, one in enumerate(np.unique(level), start=1):
        inside = level == one
        factor = float(np.exp(np.log(handed.stiffness[inside]).mean()))
        name = f"PART{number}"
        yield from (f"*ELSET, ELSET={name}", *(f"{element}," for element in np.flatnonzero(inside) + 1))
        card = scaled_card(handed, factor)
        yield from (f"*MATERIAL, NAME=TISSUE{number}", card.text)
        yield f"*SOLID SECTION, ELSET={name}, MATERIAL=TISSUE{number}"


def scaled_card(handed: HandedOver, factor: float) -> Card:
    """Return the card of the tissue whose stiffness is multiplied by a factor.

    Raises
    ------
    InputError
        CalculiX has no such law.
    """
    one = handed.material
    card = card_of(make_material(one.law, factor * one.youngs_modulus, one.poisson_ratio, one.shape.tolist()))
    if card is None:
        raise InputError(f"CalculiX has no law that is near {one.law.name}")
    return card


def _springs(handed: HandedOver, numbering: Numbering) -> Iterator[str]:
    """Write a spring to the ground for every node and axis that has one."""
    diagonal = np.einsum("nii->ni", handed.springs)
    coupled = np.abs(handed.springs - diagonal[:, :, None] * np.eye(3)).max(axis=(1, 2))
    if np.any(coupled > _NO_COUPLING * np.maximum(diagonal.max(axis=1), np.finfo(float).tiny)):
        raise InputError(
            "springs of the anchors stand askew to the axes, which SPRING1 of CalculiX cannot be"
        )
    element = len(numbering.cells)
    for node, values in lumped(diagonal, handed.problem.body.mesh, numbering, evenly=True).items():
        for axis, stiffness in zip(_AXES, values, strict=True):
            if stiffness == 0.0:
                continue
            element += 1
            yield from (f"*ELEMENT, TYPE=SPRING1, ELSET=S{element}", f"{element}, {numbering.of_node[node]}")
            yield from (f"*SPRING, ELSET=S{element}", f"{axis}", f"{stiffness:.12g}")


def _loads(handed: HandedOver, numbering: Numbering) -> Iterator[str]:
    if not handed.load.any():
        return
    yield "*CLOAD"
    for node, values in lumped(handed.load, handed.problem.body.mesh, numbering, evenly=False).items():
        for axis, force in zip(_AXES, values, strict=True):
            yield f"{numbering.of_node[node]}, {axis}, {force:.12g}"


def lumped(values: FloatArray, mesh: Mesh, numbering: Numbering, evenly: bool) -> dict[int, FloatArray]:
    """Return what is on each node (n, 3), that of nodes which CalculiX lacks shared out to those around them.

    By the shape functions virtual work stays the same, but corners get less than nothing of it, which springs must not:
    shared out evenly over the middles of edges, it is the same for what is linear in the place.
    """
    on = values.copy()
    if mesh.kind == "hex27":
        shared = np.zeros(len(values), dtype=bool)
        for middle, weights in middles():
            nodes = mesh.cells[:, middle]
            # a face of one element is the opposite one of its neighbour
            once = np.flatnonzero(~shared[nodes])
            shared[nodes] = True
            edges = [local for local, weight in weights.items() if weight > 0]
            shares = dict.fromkeys(edges, 1 / len(edges)) if evenly else weights
            for cell in once:
                for local, share in shares.items():
                    on[mesh.cells[cell, local]] += share * values[nodes[cell]]
    return {int(node): on[node] for node in numbering.nodes if on[node].any()}


def middles() -> Iterator[tuple[int, dict[int, float]]]:
    """Return each node of a hexahedron of 27 in the middle of a face or of the element, and what it follows.

    The twenty others carry it: of a face, a half of each edge less a quarter of each corner; of the element, a quarter
    of each.
    """
    for place, number in _OURS.items():
        ones = [axis for axis in range(3) if place[axis] == 1]
        if len(ones) < 2:
            continue
        around: dict[int, float] = {}
        for other in (*_CORNERS, *_EDGES):
            if all(other[axis] == place[axis] for axis in range(3) if axis not in ones):
                corner = other in _CORNERS
                around[_OURS[other]] = -0.25 if corner else 0.5 if len(ones) == 2 else 0.25
        yield number, around
