"""One run of fTetWild in a process of its own: ``python tetwild_worker.py TRIANGLES.npz TETRAHEDRA.npz``.

It writes files into the current folder, cannot be interrupted, and takes the whole process down where it fails.
"""

import sys

import numpy as np
from pytetwild.pytetwild import tetrahedralize


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


if __name__ == "__main__":
    main(*sys.argv[1:])
