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
_TERMS_IN_A_LINE = 4
# CalculiX judges residuals by the forces that act at present, and finds no end where the gripper has hardly moved.
# Below this share of the largest force it is told what force a gripped node usually bears, N, and what share to leave.
_HARDLY_MOVED, _RESIDUAL, _CORRECTION, _LEAST_FORCE_N = 0.02, 1e-3, 1e-2, 1e-2


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
    force = np.linalg.norm(run.wrench[:, :3], axis=1)
    largest = max(float(force.max()), _LEAST_FORCE_N)
    for step, pose in enumerate(run.poses):
        target = problem.gripped_positions(pose) - points[problem.gripped]
        moved = dict(zip(np.flatnonzero(problem.gripped).tolist(), target, strict=True))
        yield "*STEP, NLGEOM, INC=1000"
        if force[step] < _HARDLY_MOVED * largest:
            usual = f"{_RESIDUAL:g}, {_CORRECTION:g}, , {largest / len(gripped):.6g}"
            yield from ("*CONTROLS, PARAMETERS=FIELD", usual)
        else:
            yield "*CONTROLS, RESET"
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
    element, number = len(numbering.cells), len(numbering.nodes)
    follows = _followers(handed.problem.body.mesh) if diagonal.any() else {}
    for node in np.flatnonzero(diagonal.any(axis=1)).tolist():
        own = numbering.of_node.get(node)
        if own is None:
            number += 1
            own = number
            yield from _tied(own, handed.problem.body.mesh.points[node], follows[node], numbering)
        for axis, stiffness in zip(_AXES, diagonal[node], strict=True):
            if stiffness == 0.0:
                continue
            element += 1
            yield from (f"*ELEMENT, TYPE=SPRING1, ELSET=S{element}", f"{element}, {own}")
            yield from (f"*SPRING, ELSET=S{element}", f"{axis}", f"{stiffness:.12g}")


def _tied(number: int, place: FloatArray, follows: dict[int, float], numbering: Numbering) -> Iterator[str]:
    """Write a node in the middle of a face that moves as the element's own interpolation has it."""
    of_node = numbering.of_node
    yield from ("*NODE", f"{number}, " + ", ".join(f"{x:.12g}" for x in place))
    for axis in _AXES:
        terms = [(number, -1.0), *((of_node[node], weight) for node, weight in follows.items())]
        yield from ("*EQUATION", str(len(terms)))
        for start in range(0, len(terms), _TERMS_IN_A_LINE):
            line = terms[start : start + _TERMS_IN_A_LINE]
            yield ", ".join(f"{node}, {axis}, {weight:g}" for node, weight in line)


def _followers(mesh: Mesh) -> dict[int, dict[int, float]]:
    """Return for each node that CalculiX lacks the nodes that it follows, with their weights."""
    if mesh.kind != "hex27":
        return {}
    return {
        int(cell[middle]): {int(cell[local]): weight for local, weight in weights.items()}
        for middle, weights in middles()
        for cell in mesh.cells
    }


def _loads(handed: HandedOver, numbering: Numbering) -> Iterator[str]:
    if not handed.load.any():
        return
    yield "*CLOAD"
    for node, values in lumped(handed.load, handed.problem.body.mesh, numbering).items():
        for axis, force in zip(_AXES, values, strict=True):
            yield f"{numbering.of_node[node]}, {axis}, {force:.12g}"


def lumped(values: FloatArray, mesh: Mesh, numbering: Numbering) -> dict[int, FloatArray]:
    """Return loads on nodes (n, 3), those on nodes that CalculiX lacks shared out to the ones that they follow.

    By the shape functions, so that virtual work stays the same.
    """
    on = values.copy()
    for node, follows in _followers(mesh).items():
        for other, weight in follows.items():
            on[other] += weight * values[node]
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
