#!/usr/bin/env bash
# NIfTI without sform and qform: nibabel 5.4.2 and SimpleITK 2.5.7 have it on opposite sides
#
# Expected: a file whose sform_code and qform_code are both 0 says nothing of left and right (NIfTI-1, "method 1", for
# Analyze files); programs agree on what to make of it, or refuse it.
# What happens: nibabel turns the first axis over and puts the origin into the middle of the volume. SimpleITK has the
# origin at the first voxel and axes as in LPS, so that the second one is turned over. Between both, the volume is
# mirrored, and shifted by half its size. No warning.
# Why it matters: an organ segmented with one and placed with the other is its mirror image.
# Instead: refuse such a file, or write the orientation that you know: nibabel's set_sform(affine, code=1).
#
# Seen:
#   voxel (1, 2, 3) in RAS: nibabel [1.5, 0.0, 0.0], SimpleITK [-1.0, -2.0, 3.0]
#   mirrored between both: True
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet nibabel==5.4.2 SimpleITK==2.5.7 numpy==2.4.6

venv/bin/python - <<'PYTHON'
import nibabel
import numpy as np
import SimpleITK as sitk

volume = nibabel.Nifti1Image(np.zeros((6, 5, 7), np.uint8), None)
volume.header.set_zooms((1.0, 1.0, 1.0))
nibabel.save(volume, "volume.nii")
header = nibabel.load("volume.nii").header
if (int(header["sform_code"]), int(header["qform_code"])) != (0, 0):
    raise SystemExit("changed: nibabel states an orientation where none was given")

affine = nibabel.load("volume.nii").affine
image = sitk.ReadImage("volume.nii")
to_ras = np.diag([-1.0, -1.0, 1.0])
voxel = (1, 2, 3)
in_nibabel = (affine @ (*voxel, 1))[:3]
in_sitk = to_ras @ np.array(image.TransformIndexToPhysicalPoint(voxel))
directions = to_ras @ np.array(image.GetDirection()).reshape(3, 3)
mirrored = bool(np.linalg.det(affine[:3, :3]) * np.linalg.det(directions) < 0)
print(f"voxel {voxel} in RAS: nibabel {in_nibabel.tolist()}, SimpleITK {in_sitk.tolist()}")
print(f"mirrored between both: {mirrored}")
if not mirrored:
    raise SystemExit("changed: both have the volume on the same side")
PYTHON
