"""How good a mesh is: the shape of its elements, and how truly it follows the surface and the held regions."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.geometry.holds import HeldSurface
from estimator.surfaces.crossings import crossings
from estimator.surfaces.queries import inside, nearest
from estimator.surfaces.shells import near
from estimator.surfaces.surface import Surface, directed_edges

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_MOST_VOLUME_ERROR = 0.02
_MOST_AREA_ERROR = 0.03
_LEAST_DIHEDRAL_DEG = 2.0
# In envelopes of the mesher: beyond the first a warning, beyond the second no mesh. Meshes of lobes, organs,
# spheres and rough blocks stay within 0.8, beside walls of held regions within 2; one of a surface that crosses itself
# leaves it by 36.
_WARNED_ENVELOPES, _MOST_ENVELOPES = 2.5, 6.0
_MOST_PARTS = 64
# Places along an edge of a wall's outline where its distance from the surface is measured.
_ALONG_EDGE = 8


@dataclass(frozen=True, slots=True)
class MeshQuality:
    """Figures of a mesh of straight tetrahedra.

    Attributes
    ----------
    volume_m3 : of the meshed tissue, without what the regions hold entirely
    volume_error : relative to the surface's
    dihedral_deg : the smallest and the largest angle between two faces of a tetrahedron
    radius_ratio : the smallest and the mean of three times inradius over circumradius, 1 for a regular tetrahedron
    off_surface_m : largest distance of a free face's corners and centre from the surface
    missed_m : largest distance of the surface from the mesh, at its vertices and points between them
    covered : for each region, the area that the mesh holds over the area that it should, whatever its chords leave out
    """

    volume_m3: float
    volume_error: float
    dihedral_deg: tuple[float, float]
    radius_ratio: tuple[float, float]
    off_surface_m: float
    missed_m: float
    covered: Mapping[str, float]

    @property
    def deviation_m(self) -> float:
        """The larger of the distances of mesh and surface from each other."""
        return max(self.off_surface_m, self.missed_m)


def measure_quality(
    points: FloatArray,
    cells: IntArray,
    free: IntArray,
    held: Mapping[str, IntArray],
    body: HeldSurface,
    spacing_m: float,
) -> MeshQuality:
    """Compare a mesh with what it should be.

    Parameters
    ----------
    points : (n, 3) float64, m
    cells : (e, 4) int64
    free, held : boundary faces (f, 3) that nothing holds, and those that each region holds
    body : that was meshed
    spacing_m : of the points of the surface whose distance from the mesh is measured
    """
    corners = points[cells]
    volume = float(tetrahedron_volumes(corners).sum())
    angles, ratios = _dihedral_angles(corners), _radius_ratios(corners)
    outer = points[free]
    skin = points[np.concatenate([free, *held.values()])]
    remaining = body.surface.corners[body.remaining]
    on_surface = _held_area(points, free, held, body, spacing_m)
    covered = {
        name: (on_surface[name] if hold.core is None else _wall_area(points, held[name], body)) / hold.area_m2
        for name, hold in body.holds.items()
    }
    return MeshQuality(
        volume,
        volume / body.volume_m3 - 1.0,
        (float(angles.min()), float(angles.max())),
        (float(ratios.min()), float(ratios.mean())),
        _farthest(body.surface.corners, np.concatenate([outer.reshape(-1, 3), outer.mean(axis=1)])),
        _farthest(skin, _samples(remaining, spacing_m)),
        covered,
    )


def check_quality(quality: MeshQuality, envelope_m: float, surface: Surface) -> None:
    """Refuse a mesh from which a wrong answer would come.

    Parameters
    ----------
    quality : MeshQuality
    envelope_m : how far the mesher may leave the surface, m
    surface : that was meshed, to find a cause in

    Raises
    ------
    InputError
        Volume or held area is off, an element is flat, or the mesh leaves the surface.
    """
    faults = []
    if abs(quality.volume_error) > _MOST_VOLUME_ERROR:
        faults.append(f"its volume is off by {100 * quality.volume_error:+.1f} %")
    for name, covered in quality.covered.items():
        if abs(covered - 1.0) > _MOST_AREA_ERROR:
            faults.append(f"it covers {100 * covered:.1f} % of {name}")
    if quality.dihedral_deg[0] < _LEAST_DIHEDRAL_DEG:
        faults.append(f"an element has an angle of {quality.dihedral_deg[0]:.1f} degrees")
    if quality.deviation_m > _MOST_ENVELOPES * envelope_m:
        faults.append(_deviation(quality, envelope_m))
    if faults:
        raise InputError(f"the mesh of the surface is bad: {'; '.join(faults)}; {_remedy(surface)}")


def quality_warnings(quality: MeshQuality, envelope_m: float, surface: Surface) -> list[str]:
    """Return what is to be said of a mesh that is not bad enough to be refused; arguments as :func:`check_quality`."""
    if quality.deviation_m > _WARNED_ENVELOPES * envelope_m:
        return [f"{_deviation(quality, envelope_m)}; {_remedy(surface)}"]
    return []


def _deviation(quality: MeshQuality, envelope_m: float) -> str:
    return (
        f"mesh and surface lie {quality.deviation_m * 1e3:.2f} mm apart at most, and the mesher is allowed "
        f"{envelope_m * 1e3:.2f} mm"
    )


def _remedy(surface: Surface) -> str:
    places = crossings(surface)
    if len(places):
        return (
            f"the surface crosses itself, first {near(places[0])}: mend it there, for instance by a union or by "
            "remeshing where it was made"
        )
    return (
        "give a smaller edge length, smooth or decimate the surface, or move the boxes off its small features"
    )


def _held_area(
    points: FloatArray, free: IntArray, held: Mapping[str, IntArray], body: HeldSurface, spacing_m: float
) -> dict[str, float]:
    """Return the area of the surface that lies nearest to faces that each region holds, m².

    The faces themselves are chords, and the smaller the more the surface is curved.
    """
    corners = body.surface.corners[body.remaining]
    centres, areas = _parts(corners, spacing_m)
    face, _ = nearest(points[np.concatenate([free, *held.values()])], centres)
    ends = np.cumsum([len(free), *map(len, held.values())])
    holder = np.searchsorted(ends, face, side="right") - 1
    return {name: float(areas[holder == number].sum()) for number, name in enumerate(held)}


def _wall_area(points: FloatArray, faces: IntArray, body: HeldSurface) -> float:
    """Return the area of held walls up to the surface, m²: of the faces, and between their outline and the surface."""
    directed = directed_edges(faces)
    _, number, uses = np.unique(np.sort(directed, axis=1), axis=0, return_inverse=True, return_counts=True)
    outer = uses[number.ravel()] == 1
    a, b = points[directed[outer]].transpose(1, 0, 2)
    share = (np.arange(_ALONG_EDGE) + 0.5) / _ALONG_EDGE
    along = (a[:, None] + share[:, None] * (b - a)[:, None]).reshape(-1, 3)
    normals = np.repeat(_normals(points[faces]), 3, axis=0)[outer].repeat(_ALONG_EDGE, axis=0)
    _, foot = nearest(body.surface.corners, along)
    away = foot - along
    within_wall = away - np.einsum("px,px->p", away, normals)[:, None] * normals
    # along the wall the surface is farther than its nearest point where it is not upright on it
    square, width = np.sum(away**2, axis=1), np.linalg.norm(within_wall, axis=1)
    width = np.divide(square, width, out=np.zeros_like(width), where=width > 0)
    sign = np.where(inside(body.surface, along), 1.0, -1.0)
    length = np.linalg.norm(b - a, axis=1).repeat(_ALONG_EDGE) / _ALONG_EDGE
    return float(triangle_areas(points[faces]).sum() + (sign * width * length).sum())


def _normals(corners: FloatArray) -> FloatArray:
    """Return the unit normals (t, 3) of triangles (t, 3, 3)."""
    a, b, c = np.moveaxis(corners, 1, 0)
    normals = np.cross(b - a, c - a)
    return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))


def _samples(corners: FloatArray, spacing_m: float) -> FloatArray:
    """Return points (k, 3) on triangles (t, 3, 3), no farther apart than ``spacing_m``, their corners among them."""
    parts = _number_of_parts(corners, spacing_m)
    points = []
    for count in np.unique(parts).tolist():
        i, j = np.meshgrid(np.arange(count + 1), np.arange(count + 1), indexing="ij")
        within = i + j <= count
        shares = np.stack([i[within], j[within], count - i[within] - j[within]], axis=1) / count
        points.append((shares @ corners[parts == count]).reshape(-1, 3))
    return np.concatenate(points)


def _number_of_parts(corners: FloatArray, spacing_m: float) -> IntArray:
    """Return into how many parts the edges of triangles (t, 3, 3) are to be cut, (t,)."""
    edges = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).max(axis=1, initial=0.0)
    return np.ceil(edges / spacing_m).astype(np.int64).clip(1, _MOST_PARTS)


def _parts(corners: FloatArray, spacing_m: float) -> tuple[FloatArray, FloatArray]:
    """Cut triangles (t, 3, 3) into equal ones, no longer than ``spacing_m``; return their centres (k, 3) and areas."""
    parts = _number_of_parts(corners, spacing_m)
    centres, areas = [], []
    for count in np.unique(parts).tolist():
        chosen = corners[parts == count]
        i, j = np.meshgrid(np.arange(count), np.arange(count), indexing="ij")
        upright = np.stack([i, j], axis=-1)[i + j < count] + 1 / 3
        turned = np.stack([i, j], axis=-1)[i + j < count - 1] + 2 / 3
        two = np.concatenate([upright, turned]) / count
        shares = np.column_stack([two, 1.0 - two.sum(axis=1)])
        centres.append((shares @ chosen).reshape(-1, 3))
        areas.append(np.repeat(triangle_areas(chosen) / count**2, len(shares)))
    return np.concatenate(centres), np.concatenate(areas)


def triangle_areas(corners: FloatArray) -> FloatArray:
    """Return the areas (t,) of triangles (t, 3, 3)."""
    a, b, c = np.moveaxis(corners, 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def tetrahedron_volumes(corners: FloatArray) -> FloatArray:
    """Return the signed volumes (e,) of tetrahedra (e, 4, 3)."""
    a, b, c, d = np.moveaxis(corners, 1, 0)
    return np.einsum("ex,ex->e", np.cross(b - a, c - a), d - a) / 6


def _dihedral_angles(corners: FloatArray) -> FloatArray:
    """Return the six angles (e, 6) between the faces of each tetrahedron, degrees."""
    a, b, c, d = np.moveaxis(corners, 1, 0)
    normals = np.stack(
        [np.cross(c - b, d - b), np.cross(d - a, c - a), np.cross(b - a, d - a), np.cross(c - a, b - a)],
        axis=1,
    )
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    first, second = np.triu_indices(4, 1)
    cosine = -np.einsum("efx,efx->ef", normals[:, first], normals[:, second])
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _radius_ratios(corners: FloatArray) -> FloatArray:
    """Return 3 r/R (e,): r = 3V / ΣA, and R by the products of opposite edges (Liu & Joe 1994, section 2)."""
    a, b, c, d = np.moveaxis(corners, 1, 0)
    volume = np.abs(tetrahedron_volumes(corners))
    faces = corners[:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]]
    area = triangle_areas(faces.reshape(-1, 3, 3)).reshape(-1, 4).sum(axis=1)
    p, q, r = (
        np.linalg.norm(u - v, axis=1) * np.linalg.norm(w - x, axis=1)
        for u, v, w, x in ((a, b, c, d), (a, c, b, d), (a, d, b, c))
    )
    circumradius = np.sqrt((p + q + r) * (p + q - r) * (q + r - p) * (r + p - q)) / (24 * volume)
    return 9 * volume / area / circumradius


def _farthest(corners: FloatArray, points: FloatArray) -> float:
    _, foot = nearest(corners, points)
    return float(np.linalg.norm(points - foot, axis=1).max(initial=0.0))
