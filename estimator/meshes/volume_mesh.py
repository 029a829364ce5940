"""Volume meshes of several kinds of elements, with named regions."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

CellKind = Literal["tet4", "tet10", "pyramid5", "wedge6", "hex8"]
NODES: Mapping[CellKind, int] = {"tet4": 4, "tet10": 10, "pyramid5": 5, "wedge6": 6, "hex8": 8}
"""Number of nodes of each kind; they stand in the order of VTK, which is that of Abaqus and FEBio."""

MIRRORED: Mapping[CellKind, tuple[int, ...]] = {
    "tet4": (0, 2, 1, 3),
    "tet10": (0, 2, 1, 3, 6, 5, 4, 7, 9, 8),
    "pyramid5": (0, 3, 2, 1, 4),
    "wedge6": (0, 2, 1, 3, 5, 4),
    "hex8": (0, 3, 2, 1, 4, 7, 6, 5),
}
"""The order of the nodes that makes an element that is inside out one that is not."""

TETRAHEDRON_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
"""The corners that the last six nodes of a tet10 lie between."""


@dataclass(frozen=True, eq=False)
class VolumeMesh:
    """Points and elements.

    Attributes
    ----------
    points : (n, 3) float64, m
    blocks : elements (e, k) int64 by their kind
    regions : for each named region the elements in it, (e,) bool by kind; an element may be in several
    node_sets : for each named set its nodes, (n,) bool
    """

    points: FloatArray
    blocks: Mapping[CellKind, IntArray]
    regions: Mapping[str, Mapping[CellKind, BoolArray]] = field(default_factory=dict)
    node_sets: Mapping[str, BoolArray] = field(default_factory=dict)

    @property
    def elements(self) -> int:
        """How many elements there are."""
        return sum(len(cells) for cells in self.blocks.values())

    def members(self, region: str, kind: CellKind) -> BoolArray:
        """Return which elements (e,) of a kind a region holds."""
        none = np.zeros(len(self.blocks[kind]), dtype=bool)
        return self.regions[region].get(kind, none)

    def describe(self) -> str:
        """Return numbers of elements and nodes, in words."""
        kinds = ", ".join(f"{len(cells)} {kind}" for kind, cells in self.blocks.items())
        return f"{kinds}; {len(self.points)} nodes"


@dataclass(frozen=True, eq=False)
class FoundMesh:
    """What a file holds.

    Attributes
    ----------
    points : (n, 3) float64, in the file's unit
    blocks : elements (e, k) of each kind, as they stand there, one kind after the other
    regions, node_sets : as those of :class:`VolumeMesh`
    remarks : what was left out
    """

    points: FloatArray
    blocks: Mapping[CellKind, IntArray]
    regions: Mapping[str, Mapping[CellKind, BoolArray]]
    node_sets: Mapping[str, BoolArray]
    remarks: tuple[str, ...] = ()
