"""Segments of a DICOM segmentation object, by highdicom, which is installed with the extra ``dicom``."""

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.segmentation.label_map import LabelMap, Segment, first_line

_HINT = 'reading DICOM takes highdicom; install it with: pip install "retraction[dicom]"'


def read_dicom_seg(file: Path) -> LabelMap:
    """Return the segments of a segmentation object; each has its segment number as label.

    Raises
    ------
    InputError
        highdicom is not installed, or the file is another object, is damaged, or its frames make up no volume.
    """
    try:
        import highdicom
        from pydicom.errors import InvalidDicomError
    except ImportError:
        raise InputError(f"{file}: {_HINT}") from None
    damaged = (
        InvalidDicomError,
        ValueError,
        AttributeError,
        KeyError,
        RuntimeError,
        TypeError,
        OSError,
        EOFError,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            segmentation = highdicom.seg.segread(file)
            segments = [segmentation.get_segment_description(n) for n in segmentation.segment_numbers]
        except damaged as error:
            raise InputError(
                f"{file}: is no DICOM segmentation that can be read ({first_line(error)}); give the SEG object, not "
                "the images"
            ) from None
        try:
            volume = segmentation.get_volume(combine_segments=True, rescale_fractional=False)
            layers: tuple[NDArray[Any], ...] = (np.asarray(volume.array),)
        except (RuntimeError, ValueError):  # segments overlap, or are fractions
            layers = ()
        if not layers:
            try:
                volume = segmentation.get_volume(combine_segments=False)
            except damaged as error:
                raise InputError(
                    f"{file}: its frames make up no volume ({first_line(error)}); export it again"
                ) from None
            layers = _layers(np.asarray(volume.array), segmentation.segment_numbers)
    numbers = [int(one.segment_number) for one in segments]
    named = tuple(
        Segment(str(one.segment_label), number, place if len(layers) > 1 else 0)
        for place, (one, number) in enumerate(zip(segments, numbers, strict=True))
    )
    # slices without any segment have no frame; with one at either end the image does not seem cut off there
    T_lps_index = np.array(volume.affine, dtype=np.float64)
    T_lps_index[:3, 3] -= T_lps_index[:3, 0]
    return LabelMap(tuple(np.pad(one, ((1, 1), (0, 0), (0, 0))) for one in layers), T_lps_index, named)


def _layers(values: NDArray[Any], numbers: Sequence[int]) -> tuple[NDArray[Any], ...]:
    return tuple((values[..., place] >= 0.5) * np.uint16(number) for place, number in enumerate(numbers))
