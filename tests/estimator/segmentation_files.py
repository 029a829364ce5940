"""Segmentations written without the reader's own libraries: byte by byte, or by SimpleITK."""

import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Labels = NDArray[np.uint8]


def write_by_simpleitk(labels: Labels, T_lps_index: FloatArray, file: Path) -> None:
    """Write labels (i, j, k) with the geometry (4, 4), mm, in the format that the name asks for."""
    import SimpleITK  # 90 MB, which every process that collects the tests would hold

    spacing = np.linalg.norm(T_lps_index[:3, :3], axis=0)
    image = SimpleITK.GetImageFromArray(np.ascontiguousarray(labels.transpose(2, 1, 0)))
    image.SetSpacing(spacing.tolist())
    image.SetOrigin(T_lps_index[:3, 3].tolist())
    image.SetDirection((T_lps_index[:3, :3] / spacing).ravel().tolist())
    SimpleITK.WriteImage(image, str(file), useCompression=file.suffix in (".mha", ".gz"))


def write_nifti(
    labels: Labels,
    file: Path,
    sform: FloatArray | None,
    *,
    qform: Sequence[float] | None = None,
    unit: int = 2,
) -> None:
    """Write NIfTI-1 by the layout of its header.

    Parameters
    ----------
    labels : (i, j, k)
    file : .nii
    sform : (4, 4), RAS
    qform : quaternion b, c, d and offsets x, y, z
    unit : code of the header: 1 m, 2 mm, 3 µm
    """
    header = bytearray(352)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, 3, *labels.shape, 1, 1, 1, 1)
    struct.pack_into("<2h", header, 70, 2, 8)
    spacing = np.ones(3) if sform is None else np.linalg.norm(sform[:3, :3], axis=0)
    struct.pack_into("<8f", header, 76, 1, *spacing, 1, 1, 1, 1)
    struct.pack_into("<f", header, 108, 352.0)
    struct.pack_into("<b", header, 123, unit)
    struct.pack_into("<2h", header, 252, int(qform is not None), int(sform is not None))
    struct.pack_into("<6f", header, 256, *(qform or (0, 0, 0, 0, 0, 0)))
    if sform is not None:
        struct.pack_into("<12f", header, 280, *sform[:3].ravel())
    header[344:348] = b"n+1\0"
    file.write_bytes(bytes(header) + labels.tobytes(order="F"))
