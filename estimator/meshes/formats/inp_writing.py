"""Writes meshes as flat Abaqus input files, which CalculiX reads too."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimator.meshes.volume_mesh import CellKind, VolumeMesh

_TYPES: dict[CellKind, str] = {
    "tet4": "C3D4",
    "tet10": "C3D10",
    "pyramid5": "C3D5",
    "wedge6": "C3D6",
    "hex8": "C3D8",
}
_A_LINE = 16


def write_inp(mesh: VolumeMesh, file: Path | str) -> None:
    """Write a mesh over any file that is there; regions as element sets, sets of nodes as node sets."""
    lines = ["*HEADING", "metres", "*NODE"]
    lines += [f"{n}, {x!r}, {y!r}, {z!r}" for n, (x, y, z) in enumerate(mesh.points.tolist(), start=1)]
    starts, first = dict[CellKind, int](), 1
    for kind, cells in mesh.blocks.items():
        starts[kind] = first
        lines.append(f"*ELEMENT, TYPE={_TYPES[kind]}")
        lines += [
            f"{n}, {', '.join(map(str, row))}" for n, row in enumerate((cells + 1).tolist(), start=first)
        ]
        first += len(cells)
    for name in mesh.regions:
        members = [starts[kind] + np.flatnonzero(mesh.members(name, kind)) for kind in mesh.blocks]
        lines += [f'*ELSET, ELSET="{name}"', *_members(np.concatenate(members))]
    for name, nodes in mesh.node_sets.items():
        lines += [f'*NSET, NSET="{name}"', *_members(np.flatnonzero(nodes) + 1)]
    Path(file).write_text("\n".join(lines) + "\n", encoding="utf-8")


def _members(numbers: NDArray[np.int64]) -> Iterator[str]:
    for start in range(0, len(numbers), _A_LINE):
        yield ", ".join(map(str, numbers[start : start + _A_LINE].tolist()))
