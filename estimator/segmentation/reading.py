"""Reads a segmentation in NIfTI, NRRD, MetaImage or DICOM-SEG, told by its content: the one way in."""

import zlib
from pathlib import Path

from estimator.errors import InputError
from estimator.input_file import read_input, require_file
from estimator.segmentation.formats.dicom_seg import read_dicom_seg
from estimator.segmentation.formats.metaimage import read_metaimage
from estimator.segmentation.label_map import LabelMap, checked

MOST_BYTES = 2_000_000_000
"""Largest segmentation, unpacked."""

_FORMATS = "NIfTI (.nii, .nii.gz), NRRD, MetaImage (.mha, .mhd) or DICOM-SEG"
_GZIP = b"\x1f\x8b"
_BEGINNING = 600


def read_label_map(file: Path | str) -> LabelMap:
    """Read the labels of a segmentation and where its voxels lie.

    Raises
    ------
    InputError
        The file is missing, too large, of another kind or damaged, or does not say where its voxels lie; the message
        names it.
    """
    path = Path(file)
    size = require_file(path)
    if size > MOST_BYTES:
        raise InputError(
            f"{path}: {size / 1e6:.0f} MB, and at most {MOST_BYTES / 1e6:.0f} MB are read; crop it"
        )
    with path.open("rb") as stream:
        beginning = stream.read(_BEGINNING)
    return checked(_read(path, beginning), str(path))


def _read(path: Path, beginning: bytes) -> LabelMap:
    if beginning.startswith(_GZIP):
        content = _unpacked(path)
        if _is_nifti(content):
            return _read_nifti(content, path)
        raise InputError(f"{path}: is packed by gzip and no NIfTI; unpack it, or give {_FORMATS}")
    if _is_nifti(beginning):
        return _read_nifti(read_input(path, MOST_BYTES), path)
    if beginning.startswith(b"NRRD"):
        from estimator.segmentation.formats.nrrd_file import read_nrrd

        return read_nrrd(path)
    if beginning[128:132] == b"DICM":
        return read_dicom_seg(path)
    if b"ElementDataFile" in beginning or b"NDims" in beginning or beginning.startswith(b"ObjectType"):
        return read_metaimage(path, MOST_BYTES)
    if beginning[:4] in (b"\x5c\x01\0\0", b"\0\0\x01\x5c"):
        raise InputError(
            f"{path}: is in Analyze, or one of a pair of NIfTI files; save it as one file (.nii), which tells left "
            "from right"
            "from right"
        )
    raise InputError(f"{path}: begins with {beginning[:16]!r}; give a segmentation in {_FORMATS}")


def _read_nifti(content: bytes, path: Path) -> LabelMap:
    # its library takes a quarter of a second and 30 MB, of which who gives another body has nothing
    from estimator.segmentation.formats.nifti import read_nifti

    return read_nifti(content, path)


def _is_nifti(beginning: bytes) -> bool:
    return beginning[344:348] == b"n+1\0" or beginning[4:12] == b"n+2\0\r\n\x1a\n"


def _unpacked(path: Path) -> bytes:
    packed, parts, left = read_input(path, MOST_BYTES), list[bytes](), MOST_BYTES
    while packed:  # some programs pack in several streams, one behind the other
        stream = zlib.decompressobj(zlib.MAX_WBITS | 16)
        try:
            parts.append(stream.decompress(packed, left))
        except zlib.error as error:
            raise InputError(f"{path}: cannot be unpacked ({error}); copy it again") from None
        left -= len(parts[-1])
        if not stream.eof or not left:
            raise InputError(
                f"{path}: is cut short, or over {MOST_BYTES / 1e6:.0f} MB unpacked; copy it again, or crop it"
            )
        packed = stream.unused_data
    return b"".join(parts)
