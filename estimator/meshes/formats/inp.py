"""Meshes in Abaqus input files, with parts and instances, and flat ones as CalculiX and Gmsh write them.

meshio numbers the nodes of all parts in one list, so that those of a later part take the place of an earlier one's, and
leaves out where instances stand.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.errors import InputError
from estimator.meshes.formats.inp_syntax import Members, Model, Part, parse_inp
from estimator.meshes.volume_mesh import NODES, CellKind, FoundMesh

FloatArray = NDArray[np.float64]

# Sets of sets go no deeper.
_DEEPEST = 8


def read_inp(file: Path) -> FoundMesh:
    """Return the continuum elements of all instances, in the file's unit, with element and node sets.

    Raises
    ------
    InputError
        The file is damaged, generates nodes by keywords that are not read, or has solid elements of kinds that are not.
    """
    try:
        return _found(parse_inp(file), file)
    except (ValueError, KeyError, IndexError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"{file}: cannot be read as an Abaqus input file ({error}); write it again"
        ) from None


@dataclass
class _Placed:
    """A part in the mesh: at which index each of its nodes stands, and at which place of its kind each element."""

    part: Part
    rows: Mapping[int, int]
    places: Mapping[int, tuple[CellKind, int]]


def _found(model: Model, file: Path) -> FoundMesh:
    points, cells = list[FloatArray](), {kind: list[list[int]]() for kind in NODES}
    placed = dict[str, _Placed]()
    count = 0
    for name, part, placing in _standing(model, file):
        numbers = list(part.nodes)
        rows = dict(zip(numbers, range(count, count + len(numbers)), strict=True))
        points.append(_moved(np.array(list(part.nodes.values())).reshape(-1, 3), placing, file))
        count += len(numbers)
        places = {}
        for number, (kind, nodes) in part.elements.items():
            missing = [node for node in nodes if node not in rows]
            if missing:
                raise InputError(
                    f"{file}: element {number} names node {missing[0]}, which there is not; write it again"
                )
            places[number] = (kind, len(cells[kind]))
            cells[kind].append([rows[node] for node in nodes])
        placed[name] = _Placed(part, rows, places)
    blocks = {kind: np.array(rows, dtype=np.int64) for kind, rows in cells.items() if rows}
    total = np.concatenate(points) if points else np.zeros((0, 3))
    regions = dict[str, dict[CellKind, NDArray[np.bool_]]]()
    node_sets = dict[str, NDArray[np.bool_]]()
    for of_nodes, name, where, members in _sets(model, placed):
        if of_nodes:
            chosen = node_sets.setdefault(name, np.zeros(len(total), dtype=bool))
            chosen[[where.rows[number] for number in members if number in where.rows]] = True
            continue
        inside = regions.setdefault(
            name, {kind: np.zeros(len(one), dtype=bool) for kind, one in blocks.items()}
        )
        for number in members:
            if number in where.places:
                kind, row = where.places[number]
                inside[kind][row] = True
    kept = {name: inside for name, inside in regions.items() if any(one.any() for one in inside.values())}
    remarks = tuple(f"left out {n} elements of type {name}" for name, n in model.left_out.items())
    return FoundMesh(total, blocks, kept, {n: one for n, one in node_sets.items() if one.any()}, remarks)


def _standing(model: Model, file: Path) -> Iterator[tuple[str, Part, list[list[float]]]]:
    """Yield each part as often as it stands in the model, and how it is moved there."""
    if model.flat.nodes:
        yield "", model.flat, []
    for one in model.instances:
        if one.part not in model.parts:
            raise InputError(
                f"{file}: instance {one.name} is of part {one.part}, which there is not; write it again"
            )
        yield one.name, model.parts[one.part], one.placing
    if not model.instances:
        for name, part in model.parts.items():
            yield name, part, []


def _moved(points: FloatArray, placing: list[list[float]], file: Path) -> FloatArray:
    """Move points (n, 3) as the lines of an instance say: first a shift, then a turn about an axis, in degrees."""
    if placing:
        points = points + np.array((placing[0] + [0.0, 0.0, 0.0])[:3])
    if len(placing) > 1:
        if len(placing[1]) != 7:
            raise InputError(
                f"{file}: the turn of an instance has {len(placing[1])} numbers, not 7; write it again"
            )
        a, b, angle = np.array(placing[1][:3]), np.array(placing[1][3:6]), placing[1][6]
        axis = (b - a) / np.linalg.norm(b - a)
        points = a + Rotation.from_rotvec(np.radians(angle) * axis).apply(points - a)
    return points


def _sets(model: Model, placed: Mapping[str, _Placed]) -> Iterator[tuple[bool, str, _Placed, list[int]]]:
    """Yield whether a set is of nodes, its name, where it is, and its members; sets of sets are written out."""
    several = len(placed) > 1
    for instance, where in placed.items():
        for of_nodes, sets in ((True, where.part.node_sets), (False, where.part.element_sets)):
            for name, members in sets.items():
                shown = f"{instance}.{name}" if several and instance else name
                yield of_nodes, shown, where, _written_out(members, sets)
    for stated in model.assembly_sets:
        instance = stated.instance.upper()
        wanted = [one for key, one in placed.items() if not instance or key.upper() == instance]
        for where in wanted:
            sets = where.part.node_sets if stated.of_nodes else where.part.element_sets
            yield stated.of_nodes, stated.name, where, _written_out(stated.members, sets)


def _written_out(members: Iterable[int | str], sets: Mapping[str, Members], depth: int = 0) -> list[int]:
    by_name = {name.upper(): one for name, one in sets.items()}
    found = list[int]()
    for member in members:
        if isinstance(member, int):
            found.append(member)
        elif depth < _DEEPEST:
            found += _written_out(by_name.get(member.upper(), ()), sets, depth + 1)
    return found
