"""From a polygon soup to the closed surface of one body: repaired where that has one meaning, refused where not."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.surfaces.decimation import decimated
from estimator.surfaces.doubles import without_doubles
from estimator.surfaces.flat import flat_triangles, with_corners_joined, without_flat
from estimator.surfaces.formats.soup import PolygonSoup, soup_of_triangles
from estimator.surfaces.shells import OpenSurfaceError, near, one_body
from estimator.surfaces.surface import Surface, used_vertices
from estimator.surfaces.triangulation import triangulate
from estimator.surfaces.units import METRES, Unit, unit_of
from estimator.surfaces.welding import weld

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_MOST_TRIANGLES = 5_000_000
# Vertices closer than this share of the longest edge of the surface are one.
_WELD = 1e-7
# A surface that is open otherwise is welded so far: vertices that were rounded apart.
_WIDER_WELDS = (1e-6, 1e-5, 1e-4)


@dataclass(frozen=True, eq=False)
class RepairedSurface:
    """A closed surface.

    Attributes
    ----------
    surface : Surface
    repairs : what was done to what the file holds, in words; empty where it was taken as it is
    """

    surface: Surface
    repairs: tuple[str, ...]


def repaired(soup: PolygonSoup, source: str, unit: Unit | None = None) -> RepairedSurface:
    """Make the closed surface of one body of a polygon soup.

    Equal vertices become one; polygons are split into triangles; faces that stand twice, and triangles without area,
    go; triangles are split at corners on their edges; shells are turned outward, or inward around cavities; stray
    islands are dropped; surfaces of very many triangles are decimated.

    Parameters
    ----------
    soup : PolygonSoup
    source : file or maker, as messages name it
    unit : of the soup; None to tell it from the size

    Raises
    ------
    InputError
        A face names a vertex that there is not, the unit cannot be told, there are too few or too many faces, or the
        surface is open, branches, is one-sided, encloses nothing, or is of several bodies.
    """
    vertices, scaling = in_metres(soup, source, unit)
    used = used_vertices(soup.nodes, len(vertices))
    soup = replace(soup, vertices=vertices[used], nodes=np.searchsorted(used, soup.nodes))
    longest = float(np.ptp(soup.vertices, axis=0).max())
    found = _closed(soup, longest, source)
    surface, fewer = decimated(found.surface, source)
    return RepairedSurface(surface, (*soup.remarks, *scaling, *found.repairs, *fewer))


def _closed(soup: PolygonSoup, longest: float, source: str) -> RepairedSurface:
    """Close a surface, with vertices welded from farther off where it is open otherwise and no face is lost by that."""
    try:
        return _joined(soup, longest, _WELD, source)
    except OpenSurfaceError as first:
        for share in _WIDER_WELDS:
            try:
                found = _joined(soup, longest, share, source)
            except InputError:
                continue
            told = f"joined vertices up to {share * longest * 1e3:.2g} mm apart, between which the surface was open"
            return RepairedSurface(found.surface, (*found.repairs, told))
        if soup.remarks:
            raise InputError(f"{first}; in the file {'; '.join(soup.remarks)}") from None
        raise


def _joined(soup: PolygonSoup, longest: float, share: float, source: str) -> RepairedSurface:
    """Make the closed surface of a soup, m, whose vertices are welded up to a share of its longest edge apart."""
    repairs = list[str]()
    vertices, became = weld(soup.vertices, share * longest)
    if soup.shares_vertices and (doubled := len(became) - len(vertices)):
        repairs.append(f"merged {doubled} vertices that stood twice")
    nodes, ends, lost = _without_repeated_corners(became[soup.nodes], soup.ends)
    triangles = triangulate(vertices, nodes, ends, source)
    if lost and share > _WELD:
        raise InputError(f"{source}: welding leaves {lost} faces without area")
    if lost:
        repairs.append(f"left out {lost} faces whose corners coincide")
    triangles, doubled = without_doubles(triangles)
    if doubled:
        repairs.append(f"left out {doubled} triangles that stood twice")
    if not 4 <= len(triangles) <= _MOST_TRIANGLES:
        raise InputError(
            f"{source}: {len(triangles)} triangles; a closed surface takes 4 to {_MOST_TRIANGLES}: "
            "export it complete, or decimate it"
        )
    triangles, joined = with_corners_joined(vertices, triangles, share * longest)
    if joined:
        repairs.append(f"split {joined} triangles at corners that lay on their edges")
    triangles, flat, still_flat = without_flat(vertices, triangles, longest)
    if flat:
        repairs.append(f"removed {flat} triangles without area")
    surface, turned = one_body(vertices, triangles, source)
    if still_flat:
        _check_no_flat(surface, longest, source)
    return RepairedSurface(surface, (*repairs, *turned))


def closed_surface(vertices: FloatArray, triangles: IntArray, source: str) -> Surface:
    """Make a closed surface of triangles (t, 3) that name vertices (n, 3), m; as :func:`repaired`."""
    return repaired(soup_of_triangles(vertices, triangles), source, "m").surface


def in_metres(soup: PolygonSoup, source: str, unit: Unit | None) -> tuple[FloatArray, list[str]]:
    """Return the vertices (n, 3), m, and what to say of the unit.

    Raises
    ------
    InputError
        There are no faces, one names a vertex that there is not, a corner is not finite, or the unit cannot be told
        or does not fit the size.
    """
    _check_nodes(soup, source)
    if not len(soup.nodes):
        raise InputError(f"{source}: 0 faces; export the closed surface of the body")
    used = soup.vertices[used_vertices(soup.nodes, len(soup.vertices))]
    if not np.isfinite(used).all():
        raise InputError(f"{source}: a vertex is not finite; export the surface again")
    found, remark = unit_of(float(np.ptp(used, axis=0).max()), unit, source)
    with np.errstate(over="ignore"):  # in vertices that no face uses
        return soup.vertices * METRES[found], [remark] if remark else []


def _check_nodes(soup: PolygonSoup, source: str) -> None:
    count = len(soup.vertices)
    wrong = (soup.nodes < 0) | (soup.nodes >= count)
    if wrong.any():
        face = int(np.searchsorted(soup.ends, int(np.argmax(wrong)), side="right"))
        begin = int(soup.ends[face - 1]) if face else 0
        raise InputError(
            f"{source}: face {face} (from 0) names {soup.nodes[begin : soup.ends[face]][:6].tolist()} of {count} "
            "vertices; export the surface again"
        )


def _without_repeated_corners(nodes: IntArray, ends: IntArray) -> tuple[IntArray, IntArray, int]:
    """Drop corners that are that before them, and then the polygons of less than three, which are counted."""
    polygon = np.repeat(np.arange(len(ends)), np.diff(ends, prepend=0))
    starts = np.concatenate([[0], ends[:-1]]).astype(np.int64)
    before = np.arange(-1, len(nodes) - 1)
    some = ends > starts
    before[starts[some]] = ends[some] - 1
    repeated = nodes == nodes[before]
    left = np.bincount(polygon[~repeated], minlength=len(ends))
    kept = ~repeated & (left >= 3)[polygon]
    return nodes[kept], np.cumsum(left[left >= 3]), int(np.count_nonzero(left < 3))


def _check_no_flat(surface: Surface, longest: float, source: str) -> None:
    flat = flat_triangles(surface.vertices, surface.triangles, longest)
    if flat.any():
        at = near(surface.corners[np.argmax(flat)].mean(axis=0))
        raise InputError(
            f"{source}: {np.count_nonzero(flat)} triangles have no area and no neighbour that could take their "
            f"place, the first {at}; remove degenerate triangles where the surface was made"
        )
