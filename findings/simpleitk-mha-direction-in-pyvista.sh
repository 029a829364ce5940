#!/usr/bin/env bash
# SimpleITK 2.5.7 to pyvista 0.49.1: the direction of a .mha arrives transposed
#
# Expected: a voxel of a volume that SimpleITK wrote lies at the same place when pyvista reads it. Both keep origin,
# spacing and direction; pyvista documents `direction_matrix` as the matrix from index axes to physical axes.
# What happens: from .mha the direction is the transpose, so a tilt of +30 deg becomes -30 deg. From .nrrd the
# direction is lost, from .nii direction and origin. No warning. Without a tilt nothing shows.
# Why it matters: a volume from a tilted gantry or ultrasound sweep lies centimetres off the robot's frame.
# Instead: take the geometry from SimpleITK (`TransformIndexToPhysicalPoint`) and give it to the pyvista grid.
#
# Seen:
#   mha  last voxel  23.9 mm apart; in pyvista tilt -30 deg, origin [10.0, 20.0, 30.0]
#   nrrd last voxel  12.4 mm apart; in pyvista tilt +0 deg, origin [10.0, 20.0, 30.0]
#   nii  last voxel  37.1 mm apart; in pyvista tilt +0 deg, origin [0.0, 0.0, 0.0]
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet SimpleITK==2.5.7 pyvista==0.49.1 vtk==9.7.2 numpy==2.4.6

venv/bin/python - <<'PYTHON'
import numpy as np
import pyvista as pv
import SimpleITK as sitk

LAST = (39, 29, 19)
cos, sin = np.cos(np.pi / 6), np.sin(np.pi / 6)
direction = np.array([[1, 0, 0], [0, cos, -sin], [0, sin, cos]])
volume = sitk.GetImageFromArray(np.zeros((20, 30, 40), np.uint8))
volume.SetSpacing((0.5, 0.5, 1.0))
volume.SetOrigin((10.0, 20.0, 30.0))
volume.SetDirection(direction.ravel())
grids = {}
for ending in ("mha", "nrrd", "nii"):
    sitk.WriteImage(volume, f"volume.{ending}")
    again = np.array(sitk.ReadImage(f"volume.{ending}").TransformIndexToPhysicalPoint(LAST))
    grid = grids[ending] = pv.read(f"volume.{ending}")
    point = (np.array(grid.index_to_physical_matrix) @ (*LAST, 1))[:3]
    tilt = np.degrees(np.arctan2(grid.direction_matrix[2][1], grid.direction_matrix[2][2]))
    print(
        f"{ending:4s} last voxel {np.linalg.norm(point - again):5.1f} mm apart; in pyvista tilt {tilt + 0.0:+.0f} deg, "
        f"origin {[float(value) for value in grid.origin]}"
    )
if not np.allclose(grids["mha"].direction_matrix, direction.T):
    raise SystemExit("changed: pyvista no longer transposes the direction of a .mha")
if not (np.allclose(grids["nrrd"].direction_matrix, np.eye(3)) and np.allclose(grids["nii"].origin, 0)):
    raise SystemExit("changed: pyvista keeps the geometry of .nrrd or .nii")
PYTHON
