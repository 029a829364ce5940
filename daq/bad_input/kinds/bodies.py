"""Files of bodies that a user hands over: segmentations, volume meshes and stated phantoms."""

from collections.abc import Callable, Sequence
from pathlib import Path

from daq.bad_input.damage.any_file import BINARY, TEXT, Damage
from daq.bad_input.damage.layout import NUMBERS, PLY
from daq.bad_input.damage.value import TOML
from daq.bad_input.kind import Kind
from daq.bad_input.samples import bodies
from estimator.experiment import read_mounted_phantom
from estimator.meshes.reading import read_volume_mesh
from estimator.segmentation.reading import read_label_map

_IN_TEXT = (*TEXT, *NUMBERS)


def _segmentation(
    name: str, file: str, write: Callable[[Path], None], *more: tuple[str, Sequence[Damage]]
) -> Kind:
    """Return the kind of a segmentation, whose organ has label 1."""
    return Kind(
        name,
        write,
        dict(more) or {file: BINARY},
        read=lambda folder: read_label_map(folder / file),
        command=lambda given, out: [
            "phantom",
            str(given / file),
            "--label",
            "1",
            "--output",
            str(out / "made"),
        ],
    )


def _mesh(name: str, file: str, write: Callable[[Path], None], damages: Sequence[Damage]) -> Kind:
    """Return the kind of a volume mesh, which is converted."""
    return Kind(
        name,
        write,
        {file: damages},
        read=lambda folder: read_volume_mesh(folder / file),
        command=lambda given, out: ["mesh", str(given / file), "-o", str(out / "made.vtu")],
        quick=True,
    )


KINDS: tuple[Kind, ...] = (
    _segmentation("NIfTI", "body.nii", bodies.nifti),
    _segmentation("NIfTI, by gzip", "body.nii.gz", bodies.nifti_packed),
    _segmentation("NRRD", "body.nrrd", bodies.nrrd_file),
    _segmentation("MetaImage", "body.mhd", bodies.metaimage, ("body.mhd", _IN_TEXT), ("body.raw", BINARY)),
    _mesh("MSH", "body.msh", bodies.msh, _IN_TEXT),
    _mesh("INP", "body.inp", bodies.inp, _IN_TEXT),
    _mesh("VTU", "body.vtu", bodies.vtu, _IN_TEXT),
    _mesh("MED", "body.med", bodies.med, BINARY),
    Kind(
        "stated phantom",
        bodies.stated_phantom,
        {"phantom.toml": (*TEXT, *TOML), "painted.ply": (*_IN_TEXT, *PLY)},
        read=lambda folder: read_mounted_phantom(folder / "phantom.toml"),
        command=lambda given, out: [
            *("simulate", "--phantom", str(given / "phantom.toml"), "--output", str(out / "case")),
        ],
    ),
)
