"""Tetrahedra around triangles that may cross, touch and stick out, by fTetWild.

Y. Hu, T. Schneider, B. Wang, D. Zorin, D. Panozzo, "Fast Tetrahedral Meshing in the Wild", ACM Trans. Graph. 39
(2020). Two runs on the same input give different meshes.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

ENVELOPE = 0.025
"""How far the mesh may leave the triangles, as a share of the edge length."""

_TIMEOUT_S = 1800.0
_WORKER = Path(__file__).with_name("tetwild_worker.py")


def tetrahedra_around(corners: FloatArray, edge_length_m: float) -> tuple[FloatArray, IntArray]:
    """Fill the bounding box of triangles with tetrahedra that have the triangles among their faces.

    Parameters
    ----------
    corners : (t, 3, 3) float64, m
    edge_length_m : that is aimed at

    Returns
    -------
    points : (n, 3) float64, m
    cells : (e, 4) int64, positively oriented

    Raises
    ------
    InputError
        fTetWild fails or does not end.
    """
    vertices, triangles = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    with tempfile.TemporaryDirectory(prefix="tetwild-") as folder:
        source, target = Path(folder, "triangles.npz"), Path(folder, "tetrahedra.npz")
        np.savez(
            source,
            vertices=vertices,
            triangles=triangles.reshape(-1, 3).astype(np.int32),
            edge_length_m=edge_length_m,
            envelope_m=ENVELOPE * edge_length_m,
        )
        # -P keeps the worker's folder off the module path
        command = [sys.executable, "-P", str(_WORKER), str(source), str(target)]
        try:
            run = subprocess.run(
                command, cwd=folder, capture_output=True, text=True, timeout=_TIMEOUT_S, check=False
            )
        except subprocess.TimeoutExpired:
            raise InputError(
                f"meshing took longer than {_TIMEOUT_S:g} s; give a larger edge length or decimate the surface"
            ) from None
        if run.returncode or not target.exists():
            reason = (run.stderr.strip().splitlines() or [f"status {run.returncode}"])[-1]
            raise InputError(
                f"meshing failed ({reason}); repair or decimate the surface, or change the edge length"
            )
        with np.load(target) as result:
            return result["points"], _positive(result["points"], result["cells"].astype(np.int64))


def _positive(points: FloatArray, cells: IntArray) -> IntArray:
    """Swap two nodes of the cells whose volume is negative: all of them, in the versions known."""
    a, b, c, d = points[cells].transpose(1, 0, 2)
    negative = np.einsum("ex,ex->e", np.cross(b - a, c - a), d - a) < 0
    return np.where(negative[:, None], cells[:, [0, 2, 1, 3]], cells)
