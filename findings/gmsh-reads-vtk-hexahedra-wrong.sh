#!/usr/bin/env bash
# Gmsh 4.15.2: its reader of .vtk misplaces the mid-nodes of 20-node bricks
#
# Expected: Gmsh reads the legacy VTK file that it wrote itself, with the same elements.
# What happens: the file is right (meshio reads it, VTK's order), but Gmsh's reader takes the twelve mid-nodes
# without bringing them into its own order. Nine of twelve lie on wrong edges and a brick of volume 1 comes back
# with -0.3. Ten-node tetrahedra are right. No message.
# Why it matters: a second-order mesh that passes through .vtk to Gmsh and on to a solver (.inp, .unv, .msh) is
# folded.
# Instead: go through .msh, .unv or .med; test that each mid-node lies between its corners.
#
# Seen:
#   mid-nodes on wrong edges: read by meshio 0 of 12, by Gmsh 9 of 12
#   volume in Gmsh: made 1.000, read back -0.300
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

CORNERS = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
EDGES_VTK = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
EDGES_GMSH = [(0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7)]
HEXAHEDRON_20 = 17


def misplaced(nodes, edges):
    nodes = np.asarray(nodes)
    return sum(not np.allclose(nodes[8 + k], (nodes[i] + nodes[j]) / 2) for k, (i, j) in enumerate(edges))


def nodes_and_volume():
    """Coordinates in Gmsh's order, and the volume from Gmsh's own Jacobians."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    place = dict(zip(tags, coordinates.reshape(-1, 3), strict=True))
    _, connectivity = gmsh.model.mesh.getElementsByType(HEXAHEDRON_20)
    points, weights = gmsh.model.mesh.getIntegrationPoints(HEXAHEDRON_20, "Gauss6")
    _, determinants, _ = gmsh.model.mesh.getJacobians(HEXAHEDRON_20, points)
    return [place[tag] for tag in connectivity], float(determinants @ weights)


gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.model.add("brick")
gmsh.model.addDiscreteEntity(3, 1)
corners = np.array(CORNERS, float)
nodes = np.vstack([corners, [(corners[i] + corners[j]) / 2 for i, j in EDGES_GMSH]])
gmsh.model.mesh.addNodes(3, 1, range(1, 21), nodes.ravel())
gmsh.model.mesh.addElementsByType(1, HEXAHEDRON_20, [1], range(1, 21))
before = nodes_and_volume()[1]
gmsh.option.setNumber("Mesh.SaveAll", 1)
gmsh.write("brick.vtk")
mesh = meshio.read("brick.vtk")
by_meshio = misplaced(mesh.points[mesh.cells_dict["hexahedron20"][0]], EDGES_VTK)
gmsh.clear()
gmsh.merge("brick.vtk")
read, after = nodes_and_volume()
by_gmsh = misplaced(read, EDGES_GMSH)
print(f"mid-nodes on wrong edges: read by meshio {by_meshio} of 12, by Gmsh {by_gmsh} of 12")
print(f"volume in Gmsh: made {before:.3f}, read back {after:.3f}")
if by_meshio or not by_gmsh:
    raise SystemExit("changed: Gmsh reads the nodes of its own .vtk in their places")
PYTHON
