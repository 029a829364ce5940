"""The phantom that a segmentation gives: its surface with cavities, and the surfaces of its regions."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from estimator.errors import InputError
from estimator.segmentation.label_map import LabelMap
from estimator.segmentation.parts import Parts, Selection, parts_of
from estimator.segmentation.smoothing import SmoothShell, smooth_shell
from estimator.surfaces.queries import inside
from estimator.surfaces.repair import closed_surface
from estimator.surfaces.surface import Surface

FloatArray = NDArray[np.float64]

# By which share a surface's volume may differ from that of its voxels.
_VOLUME = 0.01
# Dice's coefficient below which the surface is said to leave out what is thin.
_THIN = 0.95


@dataclass(frozen=True, eq=False)
class SegmentedPhantom:
    """The surfaces of a phantom, m.

    Attributes
    ----------
    surface : of its tissue, with cavities
    regions : of each region, by name
    modulus_ratios : of each region
    voxels_m3 : volume of the voxels of its tissue
    in_common : Dice's coefficient of voxels and surface, the least of all shells
    cavities : how many there are
    remarks : what is to be said
    """

    surface: Surface
    regions: Mapping[str, Surface]
    modulus_ratios: Mapping[str, float]
    voxels_m3: float
    in_common: float
    cavities: int
    remarks: tuple[str, ...]

    @property
    def volume_error(self) -> float:
        """By which share the volume of the surface differs from that of the voxels."""
        return self.surface.volume_m3 / self.voxels_m3 - 1

    def moved(self, T_new_old: FloatArray) -> "SegmentedPhantom":
        """Return the phantom in another frame; the motion (4, 4) is rigid, m."""
        return replace(
            self,
            surface=moved(self.surface, T_new_old),
            regions={name: moved(one, T_new_old) for name, one in self.regions.items()},
        )


def moved(surface: Surface, T_new_old: FloatArray) -> Surface:
    """Return a surface in another frame; the motion (4, 4) is rigid, m."""
    return Surface(surface.vertices @ T_new_old[:3, :3].T + T_new_old[:3, 3], surface.triangles)


def segmented_phantom(labels: LabelMap, selection: Selection, source: str) -> SegmentedPhantom:
    """Return the phantom in the image's physical frame (LPS), m.

    Raises
    ------
    InputError
        A label is absent, the organ is in pieces, or there is no surface of its volume; the message names it.
    """
    parts = parts_of(labels, selection, source)
    T_lps_index = labels.T_lps_index.copy()
    T_lps_index[:3, 3] += T_lps_index[:3, :3] @ parts.start
    T_lps_index[:3] *= 1e-3
    outer = smooth_shell(parts.body, T_lps_index, source)
    inner = [smooth_shell(one, T_lps_index, f"{source}: a cavity") for one in parts.cavities]
    regions = {
        name: smooth_shell(mask, T_lps_index, f"{source}: region {name}")
        for name, mask in _in_one_piece(parts, source).items()
    }
    _check_apart(outer, inner, source)
    surface = _hollowed(outer.surface, [one.surface for one in inner], source)
    found = SegmentedPhantom(
        surface,
        {name: one.surface for name, one in regions.items()},
        {one.name: one.modulus_ratio for one in selection.regions},
        parts.tissue_voxels * labels.voxel_mm3 * 1e-9,
        min(one.in_common for one in (outer, *inner)),
        len(inner),
        (*labels.remarks, *parts.remarks),
    )
    return _checked(found, regions, source)


def _in_one_piece(parts: Parts, source: str) -> dict[str, NDArray[np.bool_]]:
    """Return the regions with their holes filled, as far as they hang together."""
    found = {}
    for name, mask in parts.regions.items():
        pieces, count = ndimage.label(mask)
        if count > 1:
            voxels = np.bincount(pieces.ravel())[1:]
            if voxels.max() < 0.99 * voxels.sum():
                raise InputError(
                    f"{source}: region {name} is in {count} pieces; give each a label, and name it as a region"
                )
            found[name] = np.asarray(ndimage.binary_fill_holes(pieces == np.argmax(voxels) + 1))
        else:
            found[name] = np.asarray(ndimage.binary_fill_holes(mask))
    return found


def _check_apart(outer: SmoothShell, inner: list[SmoothShell], source: str) -> None:
    """Refuse shells that cross: a wall of less than about a voxel between a cavity and the outside."""
    for number, one in enumerate(inner):
        others = [outer.surface, *(other.surface for other in inner[:number])]
        crossing = not inside(others[0], one.surface.vertices).all() or any(
            inside(other, one.surface.vertices).any() for other in others[1:]
        )
        if crossing or any(inside(one.surface, other.vertices).any() for other in others):
            at = np.round(1e3 * one.surface.vertices.mean(axis=0), 1).tolist()
            raise InputError(
                f"{source}: the wall of the cavity about {at} mm (LPS) is thinner than a voxel; thicken it in the "
                "segmentation, or make the cavity open"
            )


def _hollowed(outer: Surface, inner: list[Surface], source: str) -> Surface:
    if not inner:
        return outer
    starts = np.cumsum([0, *(len(one.vertices) for one in (outer, *inner))])
    shells = [outer.triangles, *(one.triangles[:, ::-1] for one in inner)]
    return closed_surface(
        np.concatenate([one.vertices for one in (outer, *inner)]),
        np.concatenate([one + start for one, start in zip(shells, starts, strict=False)]),
        source,
    )


def _checked(found: SegmentedPhantom, regions: Mapping[str, SmoothShell], source: str) -> SegmentedPhantom:
    errors = {"the organ": found.volume_error, **{name: one.volume_error for name, one in regions.items()}}
    for name, error in errors.items():
        if abs(error) > _VOLUME:
            raise InputError(
                f"{source}: the surface of {name} has {100 * error:+.1f} % of the voxels' volume more; it is too thin "
                "for its voxels: segment it more finely"
            )
    if found.in_common < _THIN:
        told = (
            f"surface and voxels have {100 * found.in_common:.0f} % in common (Dice): parts of a voxel or two are "
            "lost; segment more finely where they matter"
        )
        return replace(found, remarks=(*found.remarks, told))
    return found
