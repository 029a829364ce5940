#!/usr/bin/env bash
# tetgen 0.8.4 (Python): second-order tetrahedra come in TetGen's own order of nodes
#
# Expected: `tetrahedralize(order=2)` of a package of the PyVista family returns ten nodes in VTK's order (edges 01
# 12 20 03 13 23), which meshio, felupe and Abaqus share. Its documentation says "order" and no more.
# What happens: the array `elem` has TetGen's order; only the `.grid` of the same object is VTK's. Taken as VTK's,
# every element is folded: a unit cube has the volume 0.56.
# Why it matters: a finite-element solution on such elements runs and is wrong.
# Instead: `elem[:, [0, 1, 2, 3, 6, 7, 9, 5, 8, 4]]`, and check that each mid-node lies between its corners.
#
# Seen:
#   elem            5 of 6 edges misplaced, volume 0.558, 6 negative points
#   elem, reordered 0 of 6 edges misplaced, volume 1.000, 0 negative points
#   .grid           0 of 6 edges misplaced, volume 1.000, 0 negative points
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet tetgen==0.8.4 pyvista==0.49.1 vtk==9.7.2 numpy==2.4.6

venv/bin/python - <<'PYTHON'
import warnings

import numpy as np
import pyvista as pv
import tetgen

warnings.simplefilter("ignore")
EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
TO_VTK = [0, 1, 2, 3, 6, 7, 9, 5, 8, 4]


def misplaced(points, cells):
    """Edges whose node is not midway between the two corners."""
    midway = [(points[cells[:, i]] + points[cells[:, j]]) / 2 for i, j in EDGES]
    return sum(not np.allclose(points[cells[:, 4 + k]], midway[k]) for k in range(6))


def point_volumes(points, cells):
    """Jacobian times weight at the four points of the usual rule, in VTK's order."""
    near, far, parts = 0.1381966011250105, 0.5854101966249685, []
    for corner in range(4):
        at = np.full(4, near)
        at[corner] = far
        slope = np.zeros((10, 4))
        slope[range(4), range(4)] = 4 * at - 1
        for k, (i, j) in enumerate(EDGES):
            slope[4 + k, i], slope[4 + k, j] = 4 * at[j], 4 * at[i]
        jacobian = np.einsum("enk,nl->ekl", points[cells], slope[:, 1:] - slope[:, :1])
        parts.append(np.linalg.det(jacobian) / 24)
    return np.array(parts)


mesher = tetgen.TetGen(pv.Cube().triangulate())
points, elem = mesher.tetrahedralize(order=2, mindihedral=20, minratio=1.5)[:2]
cases = {"elem": elem, "elem, reordered": elem[:, TO_VTK], ".grid": mesher.grid.cells.reshape(-1, 11)[:, 1:]}
seen = {}
for name, cells in cases.items():
    parts = point_volumes(points, cells)
    wrong, volume = seen[name] = (misplaced(points, cells), parts.sum())
    print(f"{name:15s} {wrong} of 6 edges misplaced, volume {volume:.3f}, {(parts < 0).sum()} negative points")
if seen["elem"][0] == 0:
    raise SystemExit("changed: elem has VTK's order")
if any(seen[name][0] or not np.isclose(seen[name][1], 1) for name in ("elem, reordered", ".grid")):
    raise SystemExit("changed: the reordered nodes or the grid no longer have VTK's order")
PYTHON
