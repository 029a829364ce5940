"""What a segmentation holds: labels on a grid, and where its voxels lie.

The physical frame is that of DICOM: x to the patient's left, y to the back, z to the head (LPS), in millimetres.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

RAS_TO_LPS = np.diag([-1.0, -1.0, 1.0, 1.0])
"""From x to the right and y to the front to x to the left and y to the back; it is its own inverse."""

# Labels are stored as numbers that count up; an image of this many different ones is none of labels.
_MOST_LABELS = 10_000
_NAMED = 12
# Of voxels, from the finest micro-CT to thick slices.
_EDGES_MM = (1e-4, 100.0)


@dataclass(frozen=True, slots=True)
class Segment:
    """A label that the file names: what it is called, and in which layer it has which value."""

    name: str
    value: int
    layer: int = 0


@dataclass(frozen=True, eq=False)
class LabelMap:
    """Labels of voxels.

    Attributes
    ----------
    layers : each (i, j, k) of integers, 0 where nothing is; several where segments overlap
    T_lps_index : (4, 4) float64, from the index of a voxel to its centre in the physical frame, mm
    segments : those that the file names; may be empty
    remarks : what was found in the file that a reader has to know of
    """

    layers: tuple[NDArray[np.integer], ...]
    T_lps_index: FloatArray
    segments: tuple[Segment, ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def voxel_mm3(self) -> float:
        """Volume of a voxel."""
        return float(abs(np.linalg.det(self.T_lps_index[:3, :3])))

    @property
    def spacing_mm(self) -> FloatArray:
        """Distances (3,) of the centres of voxels along the axes of the grid."""
        return np.linalg.norm(self.T_lps_index[:3, :3], axis=0)

    def mask(self, label: int | str, source: str) -> BoolArray:
        """Return the voxels (i, j, k) of a label, by its number or by the name that the file gives it.

        Raises
        ------
        InputError
            There is no such label, or several; the message names those that there are.
        """
        if isinstance(label, str):
            found = [(one.layer, one.value) for one in self.segments if one.name == label]
        else:
            found = [(number, label) for number, layer in enumerate(self.layers) if np.any(layer == label)]
        if len(found) > 1:
            raise InputError(
                f"{source}: label {label} is in {len(found)} segments that overlap; name one of {self._known()}"
            )
        mask = self.layers[found[0][0]] == found[0][1] if found else np.zeros(0, dtype=bool)
        if not mask.any():
            raise InputError(f"{source}: has no voxel of label {label}; it holds {self._known()}")
        return np.asarray(mask)

    def _known(self) -> str:
        names = [f"{one.value} ({one.name})" for one in self.segments]
        if not names:
            names = [str(value) for layer in self.layers for value in np.unique(layer).tolist() if value]
        shown = ", ".join(names[:_NAMED]) or "none"
        return f"{shown} and {len(names) - _NAMED} more" if len(names) > _NAMED else shown


def first_line(error: Exception) -> str:
    """Return what an error of a library says, as part of a message of one line."""
    return (str(error) or type(error).__name__).splitlines()[0]


def whole_numbers(values: NDArray[np.generic], source: str) -> NDArray[np.integer]:
    """Return values as integers.

    Raises
    ------
    InputError
        They are fractions, as those of an image or of probabilities.
    """
    if np.issubdtype(values.dtype, np.integer):
        return values.astype(values.dtype.newbyteorder("="), copy=False)
    if values.dtype == bool:
        return values.astype(np.uint8)
    if not np.issubdtype(values.dtype, np.floating):
        raise InputError(f"{source}: its voxels are of type {values.dtype}; save one whole number for each")
    flat = values[np.isfinite(values)]
    off = flat[flat != np.round(flat)]
    if len(flat) < values.size or len(off) or np.abs(flat).max(initial=0.0) > np.iinfo(np.int32).max:
        shown = f"{off.flat[0]:g}" if len(off) else "no finite number"
        raise InputError(
            f"{source}: a voxel is {shown}; labels are whole numbers: give the segmentation, not the image, or "
            "threshold probabilities first"
        )
    return values.astype(np.int32)


def checked(labels: LabelMap, source: str) -> LabelMap:
    """Return a label map whose grid has a volume and which holds labels, not an image.

    Raises
    ------
    InputError
        It is another one.
    """
    if any(layer.ndim != 3 or not layer.size for layer in labels.layers) or not labels.layers:
        shape = " x ".join(map(str, labels.layers[0].shape)) if labels.layers else "nothing"
        raise InputError(f"{source}: holds {shape} voxels; a segmentation has three axes")
    linear = labels.T_lps_index[:3, :3]
    if not np.isfinite(labels.T_lps_index).all() or not labels.spacing_mm.min() > 0:
        raise InputError(f"{source}: its voxels have no size along an axis; write the image with its spacing")
    low, high = _EDGES_MM
    if labels.spacing_mm.min() < low or labels.spacing_mm.max() > high:
        edges = " x ".join(f"{edge:.3g}" for edge in labels.spacing_mm)
        raise InputError(f"{source}: its voxels are {edges} mm large; write the image again in millimetres")
    if abs(np.linalg.det(linear)) < 1e-6 * np.prod(labels.spacing_mm):
        raise InputError(f"{source}: two axes of its grid have the same direction; write the image again")
    for layer in labels.layers:
        if np.ptp(layer) > _MOST_LABELS and len(np.unique(layer)) > _MOST_LABELS:
            raise InputError(
                f"{source}: has over {_MOST_LABELS} different values: an image, not a segmentation"
            )
    return labels
