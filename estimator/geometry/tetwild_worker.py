"""One run of fTetWild in a process of its own: ``python tetwild_worker.py TRIANGLES.npz TETRAHEDRA.npz``.

It writes files into the current folder, cannot be interrupted, and takes the whole process down where it fails.
"""

import sys

import numpy as np
import pytetwild


def main(source: str, target: str) -> None:
    """Read vertices, triangles, edge length (m) and envelope (share of the diagonal); write points and cells."""
    with np.load(source) as job:
        points, cells = pytetwild.tetrahedralize(
            job["vertices"],
            job["triangles"],
            edge_length_abs=float(job["edge_length_m"]),
            epsilon=float(job["epsilon"]),
            disable_filtering=True,
        )
    np.savez(target, points=points, cells=cells)


if __name__ == "__main__":
    main(*sys.argv[1:])
