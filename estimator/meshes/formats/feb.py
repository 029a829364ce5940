"""Writes meshes as the mesh section of a FEBio 4.0 model ("FEBio User Manual", section "Mesh")."""

from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from estimator.meshes.formats.groups import groups_of
from estimator.meshes.volume_mesh import CellKind, VolumeMesh

_TYPES: dict[CellKind, str] = {
    "tet4": "tet4",
    "tet10": "tet10",
    "pyramid5": "pyra5",
    "wedge6": "penta6",
    "hex8": "hex8",
}


def write_feb(mesh: VolumeMesh, file: Path | str) -> None:
    """Write a mesh over any file that is there.

    A part for the elements of the same kind and regions; an element set for each region, a node set for each set.
    """
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<febio_spec version="4.0">',
        "<Mesh>",
        '<Nodes name="body">',
    ]
    lines += [
        f'<node id="{n}">{x!r},{y!r},{z!r}</node>'
        for n, (x, y, z) in enumerate(mesh.points.tolist(), start=1)
    ]
    lines.append("</Nodes>")
    first, members = 1, {name: list[int]() for name in mesh.regions}
    for part, group in enumerate(groups_of(mesh), start=1):
        cells = mesh.blocks[group.kind][group.places] + 1
        name = "_".join([f"part{part}", *group.regions])
        lines.append(f'<Elements type="{_TYPES[group.kind]}" name={quoteattr(name)}>')
        lines += [
            f'<elem id="{n}">{",".join(map(str, row))}</elem>'
            for n, row in enumerate(cells.tolist(), start=first)
        ]
        lines.append("</Elements>")
        for region in group.regions:
            members[region] += range(first, first + len(cells))
        first += len(cells)
    for name, nodes in mesh.node_sets.items():
        held = ",".join(map(str, (np.flatnonzero(nodes) + 1).tolist()))
        lines.append(f"<NodeSet name={quoteattr(name)}>{held}</NodeSet>")
    for name, numbers in members.items():
        lines.append(f"<ElementSet name={quoteattr(name)}>{','.join(map(str, numbers))}</ElementSet>")
    lines += ["</Mesh>", "</febio_spec>"]
    Path(file).write_text("\n".join(lines) + "\n", encoding="utf-8")
