"""Keeps every mesh that was made: no two runs of the mesher agree, and a fit and its predictions need the same mesh.

A mesh is found again by what it was made from. The folder is ``meshes`` in ``$RETRACT_CACHE``, by default a folder
``retract`` where the system keeps the caches of a user. It may be deleted at any time.
"""

import hashlib
import json
import os
import sys
import tempfile
import zipfile
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

import numpy as np

from estimator.errors import InputError
from estimator.experiment import Box
from estimator.fem.discretisation.mesh import Mesh
from estimator.geometry.grading import EdgeLengths
from estimator.geometry.holds import Region
from estimator.geometry.quality import MeshQuality, check_quality
from estimator.geometry.tetrahedralise import TissueMesh, envelope_m, halved, tetrahedralise
from estimator.surfaces.surface import Surface

# To be raised when the same input shall give another mesh.
_GENERATION = 2


def tissue_mesh(surface: Surface, regions: Mapping[str, Region], lengths: EdgeLengths) -> TissueMesh:
    """Return the mesh that was made of these before, or make it and keep it; as :func:`tetrahedralise`.

    Of several processes that make the same mesh at the same time, all return that of the first to finish.

    Raises
    ------
    InputError
        As :func:`tetrahedralise`, or the kept file is damaged.
    OSError
        The folder cannot be written.
    """
    file = cache_folder() / f"{_digest(surface, regions, lengths)}.npz"
    if not file.exists():
        _write(tetrahedralise(surface, regions, lengths), file)
    tissue = _read(file)
    # a mesh that was kept before it was judged is judged now
    check_quality(tissue.quality, envelope_m(lengths), surface)
    return tissue


def halved_mesh(surface: Surface, regions: Mapping[str, Region], lengths: EdgeLengths) -> TissueMesh:
    """Return :func:`tissue_mesh` with every tetrahedron cut into eight; it is made anew, and the same, every time.

    Raises
    ------
    InputError, OSError
        As :func:`tissue_mesh`.
    """
    return halved(tissue_mesh(surface, regions, lengths), surface, regions, lengths)


def cache_folder() -> Path:
    """Return where meshes are kept."""
    if chosen := os.environ.get("RETRACT_CACHE"):
        base = Path(chosen)
    elif sys.platform == "win32":
        base = Path(os.environ["LOCALAPPDATA"]) / "retract"
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches" / "retract"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "retract"
    return base / "meshes"


def _digest(surface: Surface, regions: Mapping[str, Region], lengths: EdgeLengths) -> str:
    digest = hashlib.sha256(f"{_GENERATION} {lengths}".encode())
    digest.update(surface.vertices.tobytes() + surface.triangles.tobytes())
    for name, region in regions.items():
        digest.update(name.encode())
        digest.update(str(region).encode() if isinstance(region, Box) else region.level.tobytes())
    return digest.hexdigest()


def _write(tissue: TissueMesh, file: Path) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    about = {
        "quality": asdict(tissue.quality),
        "rigid": {name: [box.lower, box.upper] for name, box in tissue.rigid.items()},
        "held": list(tissue.held),
    }
    with tempfile.TemporaryDirectory(dir=file.parent) as folder:
        whole = Path(folder, "mesh.npz")
        np.savez_compressed(
            whole,
            about=json.dumps(about),
            points=tissue.mesh.points,
            cells=tissue.mesh.cells,
            held=np.array(list(tissue.held.values())),
        )
        try:
            # Unlike a renaming, a link never replaces what another process has put there meanwhile.
            os.link(whole, file)
        except FileExistsError:
            return


def _read(file: Path) -> TissueMesh:
    try:
        with file.open("rb") as stream, np.load(stream) as kept:
            about = json.loads(str(kept["about"]))
            mesh = Mesh(kept["points"], kept["cells"], "tet10")
            held = dict(zip(about["held"], kept["held"], strict=True))
    except (ValueError, KeyError, EOFError, zipfile.BadZipFile):
        raise InputError(f"{file}: the kept mesh is damaged; remove the file, and it is made anew") from None
    quality = about["quality"]
    for name in ("dihedral_deg", "radius_ratio"):
        quality[name] = tuple(quality[name])
    rigid = {name: Box(tuple(lower), tuple(upper)) for name, (lower, upper) in about["rigid"].items()}
    return TissueMesh(mesh, held, rigid, MeshQuality(**quality))
