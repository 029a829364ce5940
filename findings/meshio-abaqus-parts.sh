#!/usr/bin/env bash
# meshio 5.3.5: Abaqus input files with parts: a later part's nodes take the place of an earlier one's
#
# Expected: a file with two parts, as Abaqus/CAE writes every model, gives both bodies where their instances stand, or
# an error that parts are not read.
# What happens: node numbers, which begin at 1 in each part, are kept in one table. The first part's elements get the
# nodes of the second, and *INSTANCE with its shift is passed over. Two bodies of equal numbering become the second
# one twice, in one place. No warning.
# Why it matters: organ and tumour, or tissue and tool, arrive as one of them, with twice the stiffness.
# Instead: write the model flat (in Abaqus: *PREPRINT, or mesh without parts and assemblies), or read parts yourself.
#
# Seen:
#   body 0: volume 1.333, from [0.0, 0.0, 0.0] to [2.0, 2.0, 2.0]; in the file 0.167, from [10, 0, 0] to [11, 1, 1]
#   body 1: volume 1.333, from [0.0, 0.0, 0.0] to [2.0, 2.0, 2.0]; in the file 1.333, from [0, 0, 0] to [2, 2, 2]
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet meshio==5.3.5 numpy==2.4.6

venv/bin/python - <<'PYTHON'
from pathlib import Path

import meshio
import numpy as np

PART = """*PART, NAME={name}
*NODE
1, 0, 0, 0
2, {size}, 0, 0
3, 0, {size}, 0
4, 0, 0, {size}
*ELEMENT, TYPE=C3D4, ELSET={name}
1, 1, 2, 3, 4
*END PART
"""
ASSEMBLY = """*ASSEMBLY, NAME=both
*INSTANCE, NAME=tumour-1, PART=tumour
10, 0, 0
*END INSTANCE
*INSTANCE, NAME=organ-1, PART=organ
*END INSTANCE
*END ASSEMBLY
"""
parts = PART.format(name="tumour", size=1) + PART.format(name="organ", size=2)
Path("model.inp").write_text("*HEADING\ntwo parts\n" + parts + ASSEMBLY)
mesh = meshio.read("model.inp")
wanted = ["0.167, from [10, 0, 0] to [11, 1, 1]", "1.333, from [0, 0, 0] to [2, 2, 2]"]
volumes = []
for number, block in enumerate(mesh.cells):
    corners = mesh.points[block.data[0]]
    volumes.append(abs(np.linalg.det(corners[1:] - corners[0])) / 6)
    lower, upper = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    print(f"body {number}: volume {volumes[-1]:.3f}, from {lower} to {upper}; in the file {wanted[number]}")
if not np.allclose(volumes, 4 / 3):
    raise SystemExit("changed: parts of Abaqus input files no longer share their nodes")
PYTHON
