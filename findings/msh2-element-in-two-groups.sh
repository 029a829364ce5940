#!/usr/bin/env bash
# Gmsh 4.15.2 and meshio 5.3.5: an element in two physical groups is doubled in MSH 2.2
#
# Expected: a body that is in the groups "tissue" and "measured" has each element once, in MSH 2.2 as in 4.1, as the
# same model was meshed once.
# What happens: the 2.2 file holds each tetrahedron once for each group, because an element has one physical tag
# there. Gmsh itself and meshio read them all: twice the elements, twice the volume, twice the stiffness. 4.1 is
# right.
# Why it matters: the stiffness that an inverse method finds from such a mesh is half the true one.
# Instead: write 4.1, or keep one of the elements with equal nodes.
#
# Seen:
#   MSH 2.2: made 1140, Gmsh reads 2280, meshio 2280 with volume 2.000
#   MSH 4.1: made 1140, Gmsh reads 1140, meshio 1140 with volume 1.000
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet gmsh==4.15.2 meshio==5.3.5 numpy==2.4.6

venv/bin/python - <<'PYTHON'
import gmsh
import meshio
import numpy as np

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.model.add("cube")
gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
gmsh.model.occ.synchronize()
gmsh.model.addPhysicalGroup(3, [1], name="tissue")
gmsh.model.addPhysicalGroup(3, [1], name="measured")
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.4)
gmsh.model.mesh.generate(3)
made = len(gmsh.model.mesh.getElements(3)[1][0])
for version in (2.2, 4.1):
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.write(f"cube{version}.msh")
seen = {}
for version in (2.2, 4.1):
    mesh = meshio.read(f"cube{version}.msh")
    cells = np.vstack([block.data for block in mesh.cells if block.type == "tetra"])
    corner = mesh.points[cells]
    volume = np.abs(np.linalg.det(corner[:, 1:] - corner[:, :1])).sum() / 6
    gmsh.clear()
    gmsh.merge(f"cube{version}.msh")
    in_gmsh = sum(len(tags) for tags in gmsh.model.mesh.getElements(3)[1])
    seen[version] = (in_gmsh / made, len(cells) / made, round(volume, 6))
    print(f"MSH {version}: made {made}, Gmsh reads {in_gmsh}, meshio {len(cells)} with volume {volume:.3f}")
if seen != {2.2: (2, 2, 2), 4.1: (1, 1, 1)}:
    raise SystemExit("changed: elements of two groups are no longer doubled in MSH 2.2 alone")
PYTHON
