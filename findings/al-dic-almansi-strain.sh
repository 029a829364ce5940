#!/usr/bin/env bash
# al-dic 1.0.3 (pyALDIC, digital image correlation): the Eulerian-Almansi strain is another quantity
#
# Expected: `strain_type=1` is E = (I - F^-T F^-1) / 2, as its docstring says ("Eulerian-Almansi" in the window, too):
# below the engineering strain in tension, and 0 for a specimen that only turns.
# What happens: it is u' / (1 - u') for each component of the displacement gradient, without the quadratic terms. In
# tension it lies above the engineering strain, even above Green-Lagrange's, and a turn of 10 deg is a contraction of
# 1.5 % in every direction. The fields dudx to dvdy hold that number, too, not the gradient. Types 0 and 2 are right.
# Why it matters: Almansi's is the strain to set beside Cauchy stress. A modulus from it is 22 % too low at 10 %
# stretch, and the error grows: at 40 % it reads 0.67 for 0.24.
# Instead: compute with `strain_type=0`, form F = I + (dudx, dudy; dvdx, dvdy), and the strain from F. The
# package of the same authors for volumes, al-dvc, has the formula.
#
# Exact displacements of a regular grid of nodes, FEM strain without smoothing.
#
# Seen:
#   stretched by 10 %
#     infinitesimal    xx +0.100, yy -0.047; formula xx +0.100, yy -0.047
#     Eulerian-Almansi xx +0.111, yy -0.044; formula xx +0.087, yy -0.050
#     Green-Lagrange   xx +0.105, yy -0.045; formula xx +0.105, yy -0.045
#   stretched by 40 %
#     infinitesimal    xx +0.400, yy -0.155; formula xx +0.400, yy -0.155
#     Eulerian-Almansi xx +0.667, yy -0.134; formula xx +0.245, yy -0.200
#     Green-Lagrange   xx +0.480, yy -0.143; formula xx +0.480, yy -0.143
#   turned by 10 deg
#     infinitesimal    xx -0.015, yy -0.015; formula xx -0.015, yy -0.015
#     Eulerian-Almansi xx -0.015, yy -0.015; formula xx +0.000, yy +0.000
#     Green-Lagrange   xx +0.000, yy +0.000; formula xx +0.000, yy +0.000
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet numba==0.68.1 scipy==1.17.1 opencv-python-headless==5.0.0.93 numpy==2.4.6
venv/bin/pip install --quiet --no-deps al-dic==1.0.3 # without its windows (PySide6)

venv/bin/python - <<'PYTHON'
import numpy as np
from al_dic.core.config import dicpara_default
from al_dic.core.data_structures import DICMesh
from al_dic.strain.compute_strain import compute_strain
from al_dic.utils.region_analysis import precompute_node_regions

NODES, STEP_PX = 9, 16
FEM_STRAIN = 3
x, y = np.meshgrid(np.arange(NODES), np.arange(NODES))
POINTS = STEP_PX * np.column_stack([x.ravel(), y.ravel()]) + 20.0
FIRST = np.flatnonzero((x < NODES - 1) & (y < NODES - 1))
# four corners; the mid-nodes of the quadtree do not exist (-1)
ELEMENTS = np.column_stack([FIRST, FIRST + 1, FIRST + NODES + 1, FIRST + NODES, *[np.full_like(FIRST, -1)] * 4])
MASK = np.ones((180, 180))
NAMES = {0: "infinitesimal", 1: "Eulerian-Almansi", 2: "Green-Lagrange"}


def reported(F, strain_type):
    """Mean strain xx, yy, xy over the nodes."""
    displacement = (POINTS - POINTS.mean(0)) @ (F - np.eye(2)).T
    settings = dicpara_default(
        strain_type=strain_type,
        method_to_compute_strain=FEM_STRAIN,
        strain_smoothness=0.0,
        winstepsize=STEP_PX,
        img_ref_mask=MASK,
    )
    regions = precompute_node_regions(POINTS, MASK, MASK.shape)
    result = compute_strain(DICMesh(POINTS, ELEMENTS), settings, displacement.ravel(), regions)
    return np.array([result.strain_exx.mean(), result.strain_eyy.mean(), result.strain_exy.mean()])


def formula(F, strain_type):
    """The three strains as named."""
    tensor = {
        0: (F + F.T) / 2 - np.eye(2),
        1: (np.eye(2) - np.linalg.inv(F @ F.T)) / 2,
        2: (F.T @ F - np.eye(2)) / 2,
    }[strain_type]
    return np.array([tensor[0, 0], tensor[1, 1], -tensor[0, 1]])  # y up


def turn(degrees):
    angle = np.radians(degrees)
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


motions = {
    "stretched by 10 %": np.diag([1.1, 1.1**-0.5]),
    "stretched by 40 %": np.diag([1.4, 1.4**-0.5]),
    "turned by 10 deg": turn(10),
}
seen = {}
for motion, F in motions.items():
    print(motion)
    for kind, name in NAMES.items():
        strain, named = seen[motion, kind] = reported(F, kind), formula(F, kind)
        shown = [f"xx {xx:+.3f}, yy {yy:+.3f}" for xx, yy, _ in np.round([strain, named], 3) + 0.0]
        print(f"  {name:16s} {shown[0]}; formula {shown[1]}")
if not all(np.allclose(*seen[motion, kind], atol=1e-9) for motion in motions for kind in (0, 2)):
    raise SystemExit("changed: the other two strains no longer follow their formulas")
if all(np.allclose(*seen[motion, 1], atol=1e-6) for motion in motions):
    raise SystemExit("changed: the Eulerian-Almansi strain follows its formula")
if not np.allclose(seen["stretched by 10 %", 1][0][0], 0.1 / (1 - 0.1)):
    raise SystemExit("changed: the Eulerian-Almansi strain is no longer u' / (1 - u')")
PYTHON
