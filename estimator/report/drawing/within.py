"""What lies within a body and no skin shows: cavities, and regions that are stiffer or softer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from estimator.errors import InputError
from estimator.experiment import Phantom
from estimator.fem.discretisation.mesh import Mesh, interpolation_rows
from estimator.report.drawing.view import View, normals
from estimator.surfaces.decimation import collapsed
from estimator.surfaces.reading import read_surface
from estimator.surfaces.surface import Surface, renumbered

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
Kind = Literal["cavity", "region"]

# A picture shows no more of its shape: a share of its diagonal.
_SHOWN = 0.01


@dataclass(frozen=True, eq=False)
class Shell:
    """The surface of a cavity or a region, seen from outside of it.

    Attributes
    ----------
    kind : which of them
    name : of the region
    label : in words
    surface : at rest, m
    """

    kind: Kind
    name: str
    label: str
    surface: Surface


@dataclass(frozen=True, eq=False)
class CarriedShell:
    """A shell that the tissue carries along.

    Attributes
    ----------
    shell : at rest
    nodes, weights : (p, k), interpolation of its corners from the nodes of a mesh
    """

    shell: Shell
    nodes: IntArray
    weights: FloatArray

    def points(self, displacement: FloatArray) -> FloatArray:
        """Return its corners (p, 3), m, at displacements (n, 3) of the nodes, m."""
        moved = np.einsum("pk,pkx->px", self.weights, displacement[self.nodes])
        return self.shell.surface.vertices + moved


def shells_within(phantom: Phantom) -> tuple[Shell, ...]:
    """Return the cavities of a phantom and its regions; none of a block.

    Raises
    ------
    InputError
        A file of the phantom cannot be read.
    """
    if phantom.surface is None:
        return ()
    body = read_surface(phantom.surface, phantom.unit).surface
    regions = [
        Shell(
            "region",
            region.name,
            f"{region.name}, {region.modulus_ratio:g} times as stiff",
            _as_shown(read_surface(region.surface, region.unit).surface),
        )
        for region in phantom.regions
    ]
    return (*(Shell("cavity", "cavity", "cavity", _as_shown(one)) for one in _cavities(body)), *regions)


def skin_of(phantom: Phantom) -> Surface | None:
    """Return the surface of a phantom's tissue, m, no finer than it is shown; None of a block.

    Raises
    ------
    InputError
        Its file cannot be read.
    """
    if phantom.surface is None:
        return None
    return _as_shown(read_surface(phantom.surface, phantom.unit).surface)


def carried(shells: tuple[Shell, ...], mesh: Mesh) -> tuple[CarriedShell, ...]:
    """Return the shells with their places in a mesh."""
    return tuple(
        CarriedShell(one, *interpolation_rows(mesh, one.surface.vertices, tolerance_m=np.inf))
        for one in shells
    )


def facing(points: FloatArray, triangles: IntArray, view: View) -> BoolArray:
    """Tell which triangles (t, 3) of points (p, 3) turn to the reader."""
    return np.asarray(view.depth(normals(points[triangles])) > 0)


def contour(triangles: IntArray, seen: BoolArray) -> IntArray:
    """Return the edges (c, 2) between triangles (t, 3) that turn to the reader (t,) and others: the outline."""
    edges = np.sort(triangles[seen][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    found, count = np.unique(edges, axis=0, return_counts=True)
    return found[count == 1]


def _cavities(body: Surface) -> list[Surface]:
    """Return the inner shells, turned as bodies of their own."""
    count = len(body.vertices)
    rows, columns = body.triangles[:, [0, 1]].ravel(), body.triangles[:, [1, 2]].ravel()
    joined = csr_array((np.ones(len(rows)), (rows, columns)), shape=(count, count))
    number, of_vertex = connected_components(joined, directed=False)
    of_triangle = of_vertex[body.triangles[:, 0]]
    shells = [renumbered(body.vertices, body.triangles[of_triangle == one]) for one in range(number)]
    return [Surface(one.vertices, one.triangles[:, ::-1]) for one in shells if one.volume_m3 < 0]


def _as_shown(surface: Surface) -> Surface:
    try:
        return collapsed(surface, _SHOWN * surface.diagonal_m, "a shell")
    except InputError:
        return surface
