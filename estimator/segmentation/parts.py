"""Which voxels are tissue, which are cavities in it, and which are regions of another modulus."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from estimator.errors import InputError
from estimator.segmentation.label_map import LabelMap

BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]

Label = int | str

# What has a smaller share of the organ's voxels is noise of the segmentation, be it beside it or a hole in it.
_NOISE = 1e-3


@dataclass(frozen=True, slots=True)
class RegionLabel:
    """A part of the tissue that is stiffer or softer than the rest.

    Attributes
    ----------
    name : of the region
    label : of its voxels
    modulus_ratio : of its Young's modulus to that of the rest
    """

    name: str
    label: Label
    modulus_ratio: float


@dataclass(frozen=True, slots=True)
class Selection:
    """Which labels make the phantom.

    Attributes
    ----------
    organ : labels of its tissue, which together hang together
    cavities : labels of what is no tissue
    regions : labels of tissue with another modulus
    fill_holes : whether what no label names within the organ is tissue
    largest : whether the largest of several bodies is meant
    """

    organ: tuple[Label, ...]
    cavities: tuple[Label, ...] = ()
    regions: tuple[RegionLabel, ...] = ()
    fill_holes: bool = False
    largest: bool = False


@dataclass(frozen=True, eq=False)
class Parts:
    """Voxels of a phantom, within the bounding box of its labels.

    Attributes
    ----------
    start : index in the image of the first voxel of the box
    body : (i, j, k) bool, the organ with what lies in it
    cavities : each (i, j, k) bool, enclosed by it
    regions : (i, j, k) bool by name, within it
    remarks : what was left out or filled
    """

    start: tuple[int, int, int]
    body: BoolArray
    cavities: tuple[BoolArray, ...]
    regions: Mapping[str, BoolArray]
    remarks: tuple[str, ...] = field(default=())

    @property
    def tissue_voxels(self) -> int:
        """Number of voxels of tissue."""
        return int(self.body.sum() - sum(one.sum() for one in self.cavities))


def parts_of(labels: LabelMap, selection: Selection, source: str) -> Parts:
    """Sort voxels by what they are.

    Raises
    ------
    InputError
        A label has no voxel, one stands for two things, the organ is in several pieces, or a region lies beside it.
    """
    _check_once(selection, source)
    shape = labels.layers[0].shape
    whole = {one.name: labels.mask(one.label, source) for one in selection.regions}
    hollow = _union([labels.mask(label, source) for label in selection.cavities], shape)
    organ = _union([labels.mask(label, source) for label in selection.organ], shape) | _union(
        list(whole.values()), shape
    )
    (box,) = ndimage.find_objects((organ | hollow).astype(np.uint8))
    organ, hollow = organ[box], hollow[box]
    regions = {name: mask[box] for name, mask in whole.items()}
    tissue = organ & ~hollow
    tissue, remarks = _one_piece(tissue, labels.voxel_mm3, selection.largest, source)
    holes, told = _holes(tissue, hollow, labels.voxel_mm3, selection.fill_holes)
    body = np.asarray(ndimage.binary_fill_holes(tissue))
    for name, region in regions.items():
        if not (region & tissue).any():
            raise InputError(f"{source}: region {name} lies apart from the organ; is it the right label?")
    i, j, k = box
    return Parts(
        (i.start, j.start, k.start),
        body,
        holes,
        {name: region & tissue for name, region in regions.items()},
        (*remarks, *told, *_open_cavities(hollow, body, labels.voxel_mm3), *_at_border(body, box, shape)),
    )


def _check_once(selection: Selection, source: str) -> None:
    used: list[Label] = [*selection.organ, *selection.cavities, *(one.label for one in selection.regions)]
    names: list[Label] = [one.name for one in selection.regions]
    for word, several in (("label", used), ("region", names)):
        doubled = [one for one in several if several.count(one) > 1]
        if doubled:
            raise InputError(f"{source}: {word} {doubled[0]} is named twice; each stands for one thing")


def _union(masks: Sequence[BoolArray], shape: tuple[int, ...]) -> BoolArray:
    return np.logical_or.reduce(masks) if masks else np.zeros(shape, dtype=bool)


def _one_piece(
    tissue: BoolArray, voxel_mm3: float, largest: bool, source: str
) -> tuple[BoolArray, tuple[str, ...]]:
    """Return the piece that voxels with common faces make."""
    pieces, count = ndimage.label(tissue)
    if not count:
        raise InputError(f"{source}: no tissue is left beside the cavities; is a label named as both?")
    if count == 1:
        return tissue, ()
    voxels = np.bincount(pieces.ravel())[1:]
    order = np.argsort(voxels)[::-1]
    large = voxels[order][voxels[order] > _NOISE * voxels[order[0]]]
    if len(large) > 1 and not largest:
        shown = ", ".join(_cm3(one, voxel_mm3) for one in large[:4])
        raise InputError(
            f"{source}: the organ is in {len(large)} pieces of {shown}; name all of its labels, or take the largest "
            "piece with --largest"
        )
    word = "piece" if count == 2 else "pieces"
    beside = _cm3(voxels.sum() - voxels[order[0]], voxel_mm3)
    return pieces == order[0] + 1, (f"left out {count - 1} {word} of {beside} beside the organ",)


def _holes(
    tissue: BoolArray, hollow: BoolArray, voxel_mm3: float, fill: bool
) -> tuple[tuple[BoolArray, ...], tuple[str, ...]]:
    """Return the cavities within the tissue, and what was made of those that no label names."""
    holes, count = ndimage.label(ndimage.binary_fill_holes(tissue) & ~tissue)
    least = _NOISE * np.count_nonzero(tissue)
    kept, remarks, filled = list[BoolArray](), list[str](), 0
    for number in range(1, count + 1):
        hole = holes == number
        if (hole & hollow).any():
            kept.append(hole)
        elif fill or hole.sum() <= least:
            filled += int(hole.sum())
        else:
            kept.append(hole)
            remarks.append(
                f"holds a hole of {_cm3(hole.sum(), voxel_mm3)} that no label names; it is left empty (--fill-holes "
                "makes it tissue)"
            )
    if filled:
        remarks.append(f"filled holes of {_cm3(filled, voxel_mm3)}")
    return tuple(kept), tuple(remarks)


def _open_cavities(hollow: BoolArray, body: BoolArray, voxel_mm3: float) -> tuple[str, ...]:
    beyond = int(np.count_nonzero(hollow & ~body))
    if not beyond:
        return ()
    return (
        f"{_cm3(beyond, voxel_mm3)} of the cavities are not enclosed by tissue; they are no part of the organ",
    )


def _at_border(body: BoolArray, box: Sequence[slice], shape: Sequence[int]) -> tuple[str, ...]:
    """Tell at which faces of the image the body ends because the image does."""
    sides = []
    for axis, name in enumerate("ijk"):
        if box[axis].start == 0 and body.take(0, axis=axis).any():
            sides.append(f"first {name}")
        if box[axis].stop == shape[axis] and body.take(-1, axis=axis).any():
            sides.append(f"last {name}")
    if not sides:
        return ()
    return (f"reaches the border of the image ({', '.join(sides)}), where it is cut off flat",)


def _cm3(voxels: float, voxel_mm3: float) -> str:
    return f"{voxels * voxel_mm3 * 1e-3:.3g} cm3"
