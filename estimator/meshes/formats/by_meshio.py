"""Meshes in MSH 2.2, VTU and MED, by meshio.

meshio takes elements as a file has them: in MSH 2.2 one for each of its groups, which
:func:`estimator.meshes.elements.in_order` puts right, and in MED with their nodes the other way round.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import meshio
import numpy as np
from meshio._exceptions import CorruptionError
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.meshes.volume_mesh import MIRRORED, CellKind, FoundMesh

IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

_KINDS: Mapping[str, CellKind] = {
    "tetra": "tet4",
    "tetra10": "tet10",
    "pyramid": "pyramid5",
    "wedge": "wedge6",
    "hexahedron": "hex8",
}
_OF_LESS_DIMENSIONS = ("vertex", "line", "triangle", "quad", "polygon")
_READERS: Mapping[str, Callable[[str], Any]] = {
    "MSH": meshio.gmsh.read,
    "VTU": meshio.vtu.read,
    "MED": meshio.med.read,
}
# What reading a damaged file raises; some of meshio's readers assert.
_DAMAGED = (
    *(
        meshio.ReadError,
        CorruptionError,
        OSError,
        EOFError,
        ValueError,
        KeyError,
        IndexError,
        TypeError,
        AttributeError,
    ),
    *(AssertionError, SystemExit, RuntimeError, MemoryError, SyntaxError, StopIteration, UnboundLocalError),
)


def read_by_meshio(file: Path, form: str) -> FoundMesh:
    """Return the volume elements of a file in ``"MSH"``, ``"VTU"`` or ``"MED"``, with their groups as regions.

    Groups of faces become sets of their nodes.

    Raises
    ------
    InputError
        The file is damaged, or has volume elements of kinds that are not read.
    """
    try:
        mesh = _READERS[form](str(file))
    except _DAMAGED as error:
        words = (str(error) or type(error).__name__).splitlines()[0]
        raise InputError(f"{file}: cannot be read as {form} ({words}); save the mesh again") from None
    points = np.asarray(mesh.points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(
            f"{file}: its nodes have {points.shape[-1]} coordinates; save the mesh in three dimensions"
        )
    unread = sorted(
        {b.type for b in mesh.cells if b.type not in _KINDS and not b.type.startswith(_OF_LESS_DIMENSIONS)}
    )
    if unread:
        raise InputError(
            f"{file}: has elements of kind {', '.join(unread)}; read are {', '.join(_KINDS)}: convert it where it was "
            "made"
        )
    groups = _groups(mesh)
    parts: dict[CellKind, list[int]] = {}
    for number, block in enumerate(mesh.cells):
        if block.type in _KINDS and len(block.data):
            parts.setdefault(_KINDS[block.type], []).append(number)
    blocks = {
        kind: np.concatenate([np.asarray(mesh.cells[n].data, dtype=np.int64) for n in numbers])
        for kind, numbers in parts.items()
    }
    if form == "MED":
        blocks = {kind: cells[:, MIRRORED[kind]] for kind, cells in blocks.items()}
    regions = dict[str, dict[CellKind, BoolArray]]()
    node_sets = _point_sets(mesh, len(points))
    for name, members in groups.items():
        inside = {kind: np.concatenate([members[n] for n in numbers]) for kind, numbers in parts.items()}
        if any(one.any() for one in inside.values()):
            regions[name] = {kind: one for kind, one in inside.items() if one.any()}
            continue
        nodes = np.zeros(len(points), dtype=bool)
        for block, one in zip(mesh.cells, members, strict=True):
            nodes[block.data[one]] = True
        if nodes.any():
            node_sets[name] = nodes
    return FoundMesh(points, blocks, regions, node_sets, _left_out(mesh))


def _left_out(mesh: Any) -> tuple[str, ...]:
    faces = sum(len(block.data) for block in mesh.cells if block.type not in _KINDS)
    return (f"left out {faces} elements of points, lines and faces",) if faces else ()


def _groups(mesh: Any) -> dict[str, list[BoolArray]]:
    """Return for each named group which elements of each block are in it."""
    groups = dict[str, list[BoolArray]]()

    def add(name: str, number: int, members: BoolArray) -> None:
        empty = [np.zeros(len(block.data), dtype=bool) for block in mesh.cells]
        groups.setdefault(name, empty)[number] |= members

    for name, sets in mesh.cell_sets.items():
        for number, members in enumerate(sets):
            if members is not None and len(members) and not name.startswith("gmsh:"):
                chosen = np.zeros(len(mesh.cells[number].data), dtype=bool)
                chosen[np.asarray(members, dtype=np.int64)] = True
                add(name, number, chosen)
    for name, tagged in _tags(mesh).items():
        for number, members in enumerate(tagged):
            add(name, number, members)
    return groups


def _tags(mesh: Any) -> dict[str, list[BoolArray]]:
    """Return groups that are stored as a number for each element: of Gmsh, of MED, and 0 or 1 in VTU."""
    found = dict[str, list[BoolArray]]()
    data = {name: [_in_one_row(one) for one in values] for name, values in mesh.cell_data.items()}
    if "gmsh:physical" in data and not mesh.cell_sets:
        names = {(int(tag), int(dim)): name for name, (tag, dim) in mesh.field_data.items()}
        dims = [meshio._mesh.topological_dimension[block.type] for block in mesh.cells]
        for (tag, dim), name in names.items():
            found[name] = [
                (one == tag) & (d == dim) for one, d in zip(data["gmsh:physical"], dims, strict=True)
            ]
    for tag, names in getattr(mesh, "cell_tags", {}).items():
        for name in names:
            members = [one == tag for one in data["cell_tags"]]
            before = found.get(name)
            found[name] = members if before is None else [a | b for a, b in zip(before, members, strict=True)]
    for name, values in data.items():
        if name not in ("gmsh:physical", "gmsh:geometrical", "cell_tags") and all(
            _is_mask(one) for one in values
        ):
            found[name] = [one.astype(bool) for one in values]
    return found


def _point_sets(mesh: Any, count: int) -> dict[str, BoolArray]:
    found = {}
    for name, members in mesh.point_sets.items():
        found[name] = np.zeros(count, dtype=bool)
        found[name][np.asarray(members, dtype=np.int64)] = True
    for name, values in mesh.point_data.items():
        if _is_mask(_in_one_row(values)):
            found[name] = _in_one_row(values).astype(bool)
    return found


def _in_one_row(values: Any) -> NDArray[Any]:
    """Return an array (n,) for one (n, 1), as meshio has it where VTU states that there is one component."""
    array = np.asarray(values)
    return array[:, 0] if array.ndim == 2 and array.shape[1] == 1 else array


def _is_mask(values: NDArray[Any]) -> bool:
    """Tell whether values are small whole numbers that are only 0 and 1, as those of a set are written."""
    return (
        values.ndim == 1
        and values.dtype.kind in "bu"
        and values.dtype.itemsize == 1
        and values.max(initial=0) <= 1
    )
