"""The shells of a surface: closed, turned outward or, around cavities, inward; stray ones dropped."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from estimator.errors import InputError
from estimator.surfaces.edges import edges_of
from estimator.surfaces.queries import inside
from estimator.surfaces.surface import Surface, directed_edges, renumbered, used_vertices

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

# A body of less than this share of the largest one, or of the shell around its cavities, is no tissue: noise of a
# segmentation, or the gap between two copies of one surface.
_ISLAND = 1e-3
# A shell encloses nothing below this share of the cubed size of the surface.
_NOTHING = 1e-12
_SAMPLES = 12
_MOST_SHELLS = 2_000
_OPEN = "is open at"


class OpenSurfaceError(InputError):
    """The surface has an edge that only one triangle has."""


def one_body(vertices: FloatArray, triangles: IntArray, source: str) -> tuple[Surface, list[str]]:
    """Return the surface of one body with its cavities, every shell turned as it should be, and what was done.

    Parameters
    ----------
    vertices : (n, 3) float64, m
    triangles : (t, 3) int64, in any orientation
    source : file or maker, as messages name it

    Raises
    ------
    InputError
        The surface is open, branches, is one-sided or encloses nothing, shells cross, or there are several bodies.
    """
    shell, turned = _consistent(vertices, triangles, source)
    triangles = np.where(turned[:, None], triangles[:, ::-1], triangles)
    volumes = _volumes(vertices, triangles, shell)
    size = float(np.linalg.norm(np.ptp(vertices[used_vertices(triangles, len(vertices))], axis=0)))
    empty = np.abs(volumes) <= _NOTHING * size**3
    if empty.all():
        raise InputError(f"{source}: the surface encloses nothing; repair it to one closed shell")
    outward = np.where((volumes < 0)[shell][:, None], triangles[:, ::-1], triangles)
    turned ^= (volumes < 0)[shell]
    nesting = _nesting(vertices, outward, shell, np.abs(volumes), empty, source)
    kept, remarks = _kept(np.abs(volumes), nesting, empty, source)
    hollow = nesting.depth % 2 == 1
    facing = np.where(hollow[shell][:, None], outward[:, ::-1], outward)
    turned ^= hollow[shell]
    chosen = kept[shell]
    return renumbered(vertices, facing[chosen]), remarks + _told_turned(turned[chosen])


@dataclass(frozen=True, eq=False)
class _Nesting:
    """How shells lie in each other: ``within[i, j]`` where i lies in j, and in how many each lies."""

    within: BoolArray

    @property
    def depth(self) -> IntArray:
        return np.count_nonzero(self.within, axis=1)


def _consistent(vertices: FloatArray, triangles: IntArray, source: str) -> tuple[IntArray, BoolArray]:
    """Return the shell (t,) that each triangle belongs to, and which ones (t,) to turn so that neighbours agree.

    Every triangle stands twice in a graph, as it is and turned over, and is linked to those versions of its
    neighbours that agree with it. One two-sided shell then falls into two components.
    """
    first, second = _neighbours(vertices, triangles, source)
    directed = directed_edges(triangles)
    agree = directed[first, 0] == directed[second, 1]
    count = len(triangles)
    a, b = first // 3, np.where(agree, second // 3, second // 3 + count)
    ends = np.concatenate([a, a + count]), np.concatenate([b, (b + count) % (2 * count)])
    links = coo_array((np.ones(2 * len(a)), ends), shape=(2 * count, 2 * count))
    _, part = connected_components(links, directed=False)
    as_is, over = part[:count], part[count:]
    if np.any(as_is == over):
        raise InputError(f"{source}: the surface is one-sided; repair it to one closed shell")
    _, shell = np.unique(np.minimum(as_is, over), return_inverse=True)
    if shell.max() >= _MOST_SHELLS:
        raise InputError(
            f"{source}: the surface has {shell.max() + 1} separate shells; keep the largest one where it was made"
        )
    first_of_shell = np.unique(shell, return_index=True)[1]
    return shell, as_is != as_is[first_of_shell][shell]


def _neighbours(vertices: FloatArray, triangles: IntArray, source: str) -> tuple[IntArray, IntArray]:
    """Return the pairs of directed edges that are one edge of the surface."""
    edges = edges_of(triangles)
    for wrong, fault in ((edges.uses == 1, _OPEN), (edges.uses > 2, "branches at")):
        if wrong.any():
            place = vertices[edges.ends(np.flatnonzero(wrong)[:1])].mean(axis=(0, 1))
            raise (OpenSurfaceError if fault == _OPEN else InputError)(
                f"{source}: the surface {fault} {np.count_nonzero(wrong)} edges, the first {near(place)}; "
                "repair it to one closed shell"
            )
    first, second = edges.order.reshape(-1, 2).T
    return first, second


def near(point: FloatArray) -> str:
    """Return a point (3,), m, as messages name it."""
    return f"near {np.round(point * 1e3, 2).tolist()} mm"


def _volumes(vertices: FloatArray, triangles: IntArray, shell: IntArray) -> FloatArray:
    """Return the signed volumes (s,) of shells."""
    corners = vertices[triangles] - vertices[triangles[0, 0]]
    a, b, c = np.moveaxis(corners, 1, 0)
    return np.bincount(shell, np.einsum("tx,tx->t", np.cross(a, b), c)) / 6


def _nesting(
    vertices: FloatArray,
    triangles: IntArray,
    shell: IntArray,
    volumes: FloatArray,
    empty: BoolArray,
    source: str,
) -> _Nesting:
    """Find which shells lie in which; triangles (t, 3) look out of their own shell."""
    count = len(volumes)
    within = np.zeros((count, count), dtype=bool)
    if count == 1:
        return _Nesting(within)
    members = [np.flatnonzero(shell == number) for number in range(count)]
    shells = [renumbered(vertices, triangles[one]) for one in members]
    samples = [one.corners[:: max(1, len(one.triangles) // _SAMPLES)].mean(axis=1) for one in shells]
    for outer in np.flatnonzero(~empty):
        lower, upper = shells[outer].bounds
        inner = [
            number
            for number in range(count)
            if volumes[number] < volumes[outer]
            and np.all(shells[number].bounds[1] > lower)
            and np.all(shells[number].bounds[0] < upper)
        ]
        if not inner:
            continue
        found = inside(shells[outer], np.concatenate([samples[number] for number in inner]))
        for number, mine in zip(
            inner, np.split(found, np.cumsum([len(samples[number]) for number in inner])[:-1]), strict=True
        ):
            within[number, outer] = mine.all()
            if mine.any() and not mine.all():
                place = shells[number].vertices.mean(axis=0)
                raise InputError(
                    f"{source}: two shells of the surface cross, of {_cm3(volumes[outer])} and "
                    f"{_cm3(volumes[number])}, {near(place)}; join them into one where the surface was made"
                )
    return _Nesting(within)


def _kept(
    volumes: FloatArray, nesting: _Nesting, empty: BoolArray, source: str
) -> tuple[BoolArray, list[str]]:
    """Tell which shells are of the largest body, and say what becomes of the others."""
    bodies = (nesting.depth % 2 == 0) & ~empty
    main = int(np.argmax(np.where(bodies, volumes, -1.0)))
    solid = volumes[main]
    others = bodies & (np.arange(len(volumes)) != main)
    large = others & (volumes > _ISLAND * solid)
    if large.any():
        named = ", ".join(_cm3(volume) for volume in np.sort(volumes[large])[::-1][:3])
        raise InputError(
            f"{source}: the surface has {np.count_nonzero(large) + 1} separate bodies, the largest of {_cm3(solid)}, "
            f"then {named}; keep one of them, or join them where the surface was made"
        )
    cavities = nesting.within[:, main] & (nesting.depth == nesting.depth[main] + 1) & ~empty
    kept = cavities.copy()
    kept[main] = True
    remarks = []
    left = solid - volumes[cavities].sum()
    if left <= _ISLAND * solid:
        raise InputError(
            f"{source}: the surface stands twice, one shell close within the other: between them is {_cm3(left)} of "
            f"{_cm3(solid)}; keep one of the two where the surface was made"
        )
    if cavities.any():
        word = "cavity" if np.count_nonzero(cavities) == 1 else "cavities"
        remarks.append(f"left {np.count_nonzero(cavities)} {word} of {_cm3(volumes[cavities].sum())} empty")
    if dropped := int(np.count_nonzero(~kept)):
        word = "island" if dropped == 1 else "islands"
        remarks.append(
            f"dropped {dropped} {word} of {_cm3(volumes[~kept].sum())} beside the body or in its cavities"
        )
    return kept, remarks


def _told_turned(turned: BoolArray) -> list[str]:
    if not turned.any():
        return []
    if turned.all():
        return ["turned the surface, which was inside out"]
    return [f"turned {np.count_nonzero(turned)} triangles that faced the wrong way"]


def _cm3(volume_m3: float) -> str:
    return f"{volume_m3 * 1e6:.3g} cm3"
