"""Files of surfaces that a user hands over, with their reader and verb."""

from collections.abc import Callable, Sequence
from pathlib import Path

from daq.bad_input.damage.any_file import BINARY, TEXT, Damage
from daq.bad_input.damage.layout import NUMBERS, PLY, STL, VTP
from daq.bad_input.kind import Kind
from daq.bad_input.samples import packed_surfaces, surfaces
from estimator.surfaces.reading import read_surface

_IN_TEXT = (*TEXT, *NUMBERS)


def _surface(name: str, file: str, write: Callable[[Path], None], damages: Sequence[Damage]) -> Kind:
    """Return the kind of a surface file, which is read by ``retract mesh``."""
    return Kind(
        name,
        write,
        {file: damages},
        read=lambda folder: read_surface(folder / file),
        command=lambda given, out: ["mesh", str(given / file), "-o", str(out / "mesh.vtu")],
    )


KINDS: tuple[Kind, ...] = (
    _surface("STL", "body.stl", surfaces.stl, (*BINARY, *STL)),
    _surface("STL, text", "body.stl", surfaces.stl_text, _IN_TEXT),
    _surface("PLY", "body.ply", surfaces.ply, (*BINARY, *PLY)),
    _surface("PLY, text", "body.ply", surfaces.ply_text, (*_IN_TEXT, *PLY)),
    _surface("OBJ", "body.obj", surfaces.obj, _IN_TEXT),
    _surface("VTP", "body.vtp", surfaces.vtp, (*_IN_TEXT, *VTP)),
    _surface("VTP, by LZ4", "body.vtp", packed_surfaces.vtp_packed, (*BINARY, *VTP)),
    _surface("VTP, by LZMA", "body.vtp", packed_surfaces.vtp_lzma, (*BINARY, *VTP)),
    _surface("PLY, strips", "body.ply", packed_surfaces.ply_of_strips, (*BINARY, *PLY)),
)  # fmt: skip
