#!/usr/bin/env bash
# meshio 5.3.5 and MED files: volume elements are inside out for MED's own library (medcoupling 9.15.0)
#
# Expected: a tetrahedron that meshio writes as .med has a positive volume there, and one that MEDCoupling (Salome,
# code_aster) writes is positive in meshio.
# What happens: MED numbers volume elements the other way round than VTK, Gmsh and Abaqus. Gmsh turns them when it
# writes and reads .med, meshio does not, in either direction. Through meshio alone nothing shows, as the two errors
# cancel.
# Why it matters: signed volumes, outward faces and pressures have the wrong sign; many programs take the absolute
# value and hide it.
# Instead: write .med with Gmsh, or swap nodes (tetrahedron: 1 and 2) on the way in and out; test the Jacobian.
#
# Seen:
#   written by meshio, in MEDCoupling       volume -0.167
#   written by Gmsh, in MEDCoupling         volume +0.167
#   written by MEDCoupling, in MEDCoupling  volume +0.167
#   written by MEDCoupling, in meshio       volume -0.167
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet meshio==5.3.5 h5py==3.16.0 medcoupling==9.15.0 gmsh==4.15.2 numpy==2.2.6

venv/bin/python - <<'PYTHON'
import gmsh
import medcoupling
import meshio
import numpy as np

POINTS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])


def signed_volume(points):
    """Positive if node 3 sees 0, 1, 2 counter-clockwise, as in VTK, Gmsh and Abaqus."""
    return float(np.linalg.det(points[1:] - points[0]) / 6)


def in_medcoupling(path):
    return float(medcoupling.ReadUMeshFromFile(path).getMeasureField(False).getArray().getValues()[0])


meshio.Mesh(POINTS, [("tetra", np.array([[0, 1, 2, 3]]))]).write("meshio.med")

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.model.add("tetrahedron")
gmsh.model.addDiscreteEntity(3, 1)
gmsh.model.mesh.addNodes(3, 1, [1, 2, 3, 4], POINTS.ravel())
gmsh.model.mesh.addElementsByType(1, 4, [1], [1, 2, 3, 4])
gmsh.option.setNumber("Mesh.SaveAll", 1)
gmsh.write("gmsh.med")

made = medcoupling.MEDCouplingUMesh("tetrahedron", 3)
made.setCoords(medcoupling.DataArrayDouble(POINTS.copy()))
made.allocateCells(1)
made.insertNextCell(medcoupling.NORM_TETRA4, [0, 2, 1, 3])  # MED's way round: positive there
made.finishInsertingCells()
medcoupling.WriteUMesh("medcoupling.med", made, True)

volumes = {
    "written by meshio, in MEDCoupling": in_medcoupling("meshio.med"),
    "written by Gmsh, in MEDCoupling": in_medcoupling("gmsh.med"),
    "written by MEDCoupling, in MEDCoupling": in_medcoupling("medcoupling.med"),
}
mesh = meshio.read("medcoupling.med")
volumes["written by MEDCoupling, in meshio"] = signed_volume(mesh.points[mesh.cells_dict["tetra"][0]])
for name, volume in volumes.items():
    print(f"{name:39s} volume {volume:+.3f}")
if [volume > 0 for volume in volumes.values()] != [False, True, True, False]:
    raise SystemExit("changed: meshio turns volume elements of MED files")
PYTHON
