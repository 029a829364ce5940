"""Elements sorted by which regions they are in, for formats where an element is in one group only."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimator.meshes.volume_mesh import CellKind, VolumeMesh


class Group(NamedTuple):
    """Elements of one kind that are in the same regions: their places among those of the kind."""

    regions: tuple[str, ...]
    kind: CellKind
    places: NDArray[np.int64]


def groups_of(mesh: VolumeMesh) -> Iterator[Group]:
    """Yield the elements of a mesh, each once."""
    names = tuple(mesh.regions)
    for kind, cells in mesh.blocks.items():
        inside = np.array([mesh.members(name, kind) for name in names], dtype=bool).reshape(
            len(names), len(cells)
        )
        patterns, which = np.unique(inside, axis=1, return_inverse=True)
        for number, pattern in enumerate(patterns.T):
            places = np.flatnonzero(which.reshape(-1) == number)
            yield Group(tuple(n for n, there in zip(names, pattern, strict=True) if there), kind, places)
