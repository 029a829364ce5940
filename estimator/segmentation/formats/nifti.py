"""Label maps in NIfTI-1 and NIfTI-2 (.nii, .nii.gz); geometry by nibabel, the unit from the header.

nibabel leaves the header's unit of length to its caller, and gives a file that states no orientation one in which the
first axis is turned over.
"""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import nibabel
import numpy as np
from nibabel.filebasedimages import ImageFileError
from nibabel.imageglobals import logger
from nibabel.spatialimages import HeaderDataError
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.segmentation.label_map import RAS_TO_LPS, LabelMap, first_line, whole_numbers

FloatArray = NDArray[np.float64]

_UNITS_MM = {"meter": 1e3, "mm": 1.0, "micron": 1e-3, "unknown": 1.0}
# sform and qform that put no voxel farther apart than this share of one say the same, to the qform's precision.
_SAME = 0.05


def read_nifti(content: bytes, file: Path) -> LabelMap:
    """Return the labels of a file that is unpacked already.

    Raises
    ------
    InputError
        It is damaged, states no orientation, or has more than three axes.
    """
    kind = nibabel.Nifti2Image if content[:4] in (b"\x1c\x02\0\0", b"\0\0\x02\x1c") else nibabel.Nifti1Image
    try:
        with _told() as told:
            image = kind.from_bytes(content)
        # nibabel makes room for what the header tells before it looks for it
        if int(np.prod(np.array(image.shape, dtype=object))) * image.get_data_dtype().itemsize > len(content):
            raise ValueError(
                f"it tells of {' x '.join(map(str, image.shape))} voxels, for which it is too short"
            )
        values = np.asarray(image.dataobj)
    except (ImageFileError, HeaderDataError, ValueError, OSError, EOFError, MemoryError) as error:
        raise InputError(
            f"{file}: cannot be read as NIfTI ({first_line(error)}); save it again, or copy it again"
        ) from None
    affine, remarks = _affine(image.header, values.shape[:3], file)
    remarks = (*told, *remarks)
    while values.ndim > 3 and values.shape[-1] == 1:
        values = values[..., 0]
    try:
        unit = image.header.get_xyzt_units()[0]
    except KeyError as error:
        raise InputError(
            f"{file}: its unit of length has the code {error}, which there is not; save it again"
        ) from None
    if unit != "mm":
        remarks = (
            *remarks,
            "states no unit; taken as millimetres" if unit == "unknown" else f"is in {unit}s",
        )
    T_lps_index = RAS_TO_LPS @ affine
    T_lps_index[:3] *= _UNITS_MM[unit]
    return LabelMap((whole_numbers(values, str(file)),), T_lps_index, remarks=remarks)


@contextmanager
def _told() -> Iterator[list[str]]:
    """Collect what nibabel finds odd in a header and mends, which it would write to standard error."""
    told = list[str]()

    class Collector(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            told.append(record.getMessage())

    handlers, logger.handlers = logger.handlers, [Collector()]
    try:
        yield told
    finally:
        logger.handlers = handlers


def _affine(
    header: nibabel.Nifti1Header, shape: tuple[int, ...], file: Path
) -> tuple[FloatArray, tuple[str, ...]]:
    """Return the way from index to RAS, in the header's unit: the sform where there is one, else the qform."""
    sform, sform_code = header.get_sform(coded=True)
    qform, qform_code = header.get_qform(coded=True)
    if sform is None and qform is None:
        raise InputError(
            f"{file}: states neither sform nor qform, so nobody can tell its left from its right; write it again with "
            "its orientation"
        )
    if sform is None:
        return np.array(qform, dtype=np.float64), ()
    affine = np.array(sform, dtype=np.float64)
    if qform is None:
        return affine, ()
    corners = np.array(np.meshgrid(*([0, count - 1] for count in (*shape, 1, 1)[:3]), 1)).reshape(4, -1)
    apart = float(np.linalg.norm(((affine - qform) @ corners)[:3], axis=0).max())
    if apart <= _SAME * np.linalg.norm(affine[:3, :3], axis=0).min():
        return affine, ()
    return affine, (
        f"its sform (code {int(sform_code)}) and qform (code {int(qform_code)}) put voxels up to {apart:.3g} apart; "
        "the sform is taken",
    )
