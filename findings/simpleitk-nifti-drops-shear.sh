#!/usr/bin/env bash
# SimpleITK 2.5.7: a sheared volume is straightened when it is written as NIfTI
#
# Expected: a volume of a tilted gantry (axes that are not at right angles) keeps the places of its voxels in .nii, as
# the sform can hold any affine and as .nrrd and .mha of the same library do; or writing fails.
# What happens: the file holds the nearest orthogonal axes. A line on standard error says so; no exception. The other
# way round, a sheared sform, as resampling tools write, is refused by SimpleITK, though nibabel reads it.
# Why it matters: the far end of the volume has moved by millimetres, and a batch does not notice.
# Instead: write .nrrd or .mha, or resample to right angles first.
#
# Seen:
#   .nrrd last voxel  0.00 mm off
#   .mha  last voxel  0.00 mm off
#   .nii  last voxel  6.26 mm off
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet SimpleITK==2.5.7 numpy==2.4.6

venv/bin/python - <<'PYTHON'
import numpy as np
import SimpleITK as sitk

LAST = (39, 29, 19)
tilt = np.radians(15.0)
volume = sitk.GetImageFromArray(np.zeros((20, 30, 40), np.uint8))
volume.SetSpacing((0.5, 0.5, 2.5))
volume.SetDirection((1, 0, 0, 0, 1, np.sin(tilt), 0, 0, np.cos(tilt)))
meant = np.array(volume.TransformIndexToPhysicalPoint(LAST))
off = {}
for ending in ("nrrd", "mha", "nii"):
    sitk.WriteImage(volume, f"volume.{ending}")
    again = np.array(sitk.ReadImage(f"volume.{ending}").TransformIndexToPhysicalPoint(LAST))
    off[ending] = float(np.linalg.norm(again - meant))
    print(f".{ending:4s} last voxel {off[ending]:5.2f} mm off")
if not (off["nrrd"] < 0.01 and off["mha"] < 0.01 and off["nii"] > 1):
    raise SystemExit("changed: a sheared volume stays sheared in NIfTI, or no longer in NRRD and MHA")
PYTHON
