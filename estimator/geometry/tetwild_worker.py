"""One run of fTetWild in a process of its own: ``python tetwild_worker.py TRIANGLES.npz TETRAHEDRA.npz``.

It writes files into the current folder, cannot be interrupted, and takes the whole process down where it fails.
"""

import ctypes
import signal
import sys

import numpy as np
from pytetwild.pytetwild import tetrahedralize

_PR_SET_PDEATHSIG = 1  # prctl(2)


def main(source: str, target: str) -> None:
    """Read vertices and triangles, edge length and envelope; write points and cells. Lengths in m."""
    with np.load(source) as job:
        diagonal_m = float(np.linalg.norm(np.ptp(job["vertices"], axis=0)))
        points, cells = tetrahedralize(
            job["vertices"],
            job["triangles"],
            edge_length_abs=float(job["edge_length_m"]),
            epsilon=float(job["envelope_m"]) / diagonal_m,
            # at these sizes threads mostly wait for each other
            num_threads=1,
            disable_filtering=True,
        )
    np.savez(target, points=points, cells=cells)


def _end_with_parent() -> None:
    """Ask Linux to end this process when the one that wants the mesh is gone; no thread here runs while it meshes."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


if __name__ == "__main__":
    _end_with_parent()
    main(*sys.argv[1:])
