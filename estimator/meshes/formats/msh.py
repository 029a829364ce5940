"""Writes meshes as MSH 4.1 text ("Gmsh reference manual", section "MSH file format").

In 4.1 an element may be in several groups; in 2.2 it would have to stand there once for each.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimator.fem.discretisation.mesh import Mesh
from estimator.fem.discretisation.surface import boundary_faces
from estimator.meshes.formats.groups import groups_of
from estimator.meshes.volume_mesh import CellKind, VolumeMesh

IntArray = NDArray[np.int64]

_TYPES: dict[CellKind, int] = {"tet4": 4, "hex8": 5, "wedge6": 6, "pyramid5": 7, "tet10": 11}
# Gmsh has the last two middle nodes of a tet10 the other way round.
_ORDER: dict[CellKind, list[int]] = {"tet10": [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]}
_FACE_TYPES = {3: 2, 6: 9}


def write_msh(mesh: VolumeMesh, file: Path | str) -> None:
    """Write a mesh over any file that is there; sets of nodes as groups of the boundary faces that they hold."""
    groups, patches = list(groups_of(mesh)), _patches(mesh)
    number = {name: tag for tag, name in enumerate([*mesh.regions, *patches], start=1)}
    box = " ".join(repr(value) for value in np.concatenate([mesh.points.min(0), mesh.points.max(0)]).tolist())
    lines = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(number))]
    lines += [f'3 {number[name]} "{_quoted(name)}"' for name in mesh.regions]
    lines += [f'2 {number[name]} "{_quoted(name)}"' for name in patches]
    lines += ["$EndPhysicalNames", "$Entities", f"0 0 {len(patches)} {len(groups)}"]
    lines += [f"{tag} {box} 1 {number[name]} 0" for tag, name in enumerate(patches, start=1)]
    for tag, group in enumerate(groups, start=1):
        tags = " ".join(str(number[name]) for name in group.regions)
        lines.append(f"{tag} {box} {len(group.regions)} {tags} 0")
    count = len(mesh.points)
    lines += ["$EndEntities", "$Nodes", f"1 {count} 1 {count}", f"3 1 0 {count}"]
    lines += [str(one) for one in range(1, count + 1)]
    lines += [f"{x!r} {y!r} {z!r}" for x, y, z in mesh.points.tolist()]
    parts = [
        (2, tag, _FACE_TYPES[faces.shape[1]], faces) for tag, faces in enumerate(patches.values(), start=1)
    ]
    for tag, group in enumerate(groups, start=1):
        cells = mesh.blocks[group.kind][group.places]
        parts.append((3, tag, _TYPES[group.kind], cells[:, _ORDER.get(group.kind, slice(None))]))
    lines += ["$EndNodes", "$Elements"]
    total = sum(len(cells) for *_, cells in parts)
    lines.append(f"{len(parts)} {total} 1 {total}")
    first = 1
    for dimension, tag, kind, cells in parts:
        lines.append(f"{dimension} {tag} {kind} {len(cells)}")
        rows = np.column_stack([np.arange(first, first + len(cells)), cells + 1])
        lines += [" ".join(map(str, row)) for row in rows.tolist()]
        first += len(cells)
    lines.append("$EndElements")
    Path(file).write_text("\n".join(lines) + "\n", encoding="utf-8")


def _patches(mesh: VolumeMesh) -> dict[str, IntArray]:
    """Return the boundary faces of tetrahedra that sets of nodes hold."""
    faces = {
        kind: boundary_faces(Mesh(mesh.points, cells, kind))
        for kind, cells in mesh.blocks.items()
        if kind == "tet4" or kind == "tet10"
    }
    patches = {}
    for name, nodes in mesh.node_sets.items():
        for one in faces.values():
            held = one[nodes[one].all(axis=1)]
            if len(held):
                patches[name] = held
    return patches


def _quoted(name: str) -> str:
    return name.replace('"', "'")
