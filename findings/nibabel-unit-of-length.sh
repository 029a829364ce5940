#!/usr/bin/env bash
# nibabel 5.4.2: the affine of a NIfTI file is in the file's unit, whatever that is
#
# Expected: `image.affine` maps voxels "to the RAS+ coordinates of the scanner" in millimetres, as nibabel's page on
# coordinate systems has it.
# What happens: a file whose header says metres or micrometres (xyzt_units), as micro-CT and microscopes write, gives
# an affine in metres or micrometres. SimpleITK 2.5.7 converts both to millimetres. The two are apart by 1000.
# Why it matters: a phantom scanned by micro-CT is 1000 times too large, or its voxels 1e9 times too many.
# Instead: multiply by what `image.header.get_xyzt_units()[0]` says.
#
# Seen:
#   metres      voxel edge: nibabel 0.001, SimpleITK 1 mm
#   micrometres voxel edge: nibabel 1000, SimpleITK 1 mm
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

found = {}
for name, unit, edge in (("metres", "meter", 1e-3), ("micrometres", "micron", 1e3)):
    volume = nibabel.Nifti1Image(np.zeros((6, 5, 7), np.uint8), np.diag([edge, edge, edge, 1.0]))
    volume.header.set_xyzt_units(unit)
    nibabel.save(volume, "volume.nii")
    in_nibabel = float(np.linalg.norm(nibabel.load("volume.nii").affine[:3, 0]))
    in_sitk = sitk.ReadImage("volume.nii").GetSpacing()[0]
    found[name] = round(in_sitk / in_nibabel, 6)
    print(f"{name:11s} voxel edge: nibabel {in_nibabel:.6g}, SimpleITK {in_sitk:.6g} mm")
if found != {"metres": 1000.0, "micrometres": 0.001}:
    raise SystemExit("changed: the affine is in millimetres, or SimpleITK no longer converts")
PYTHON
