#!/usr/bin/env bash
# NRRD with axis mins: SimpleITK 2.5.7 and pyvista 0.49.1 disagree with the header and with each other
#
# Expected: a header of 4 x 5 x 6 samples with `axis mins: 10 20 30`, and either `axis maxs: 12 22.5 42` or
# `spacings: 0.5 0.5 2` says where the volume is: both times with spacing 0.5, 0.5, 2 (cells; definition of the NRRD
# format).
# What happens: with mins and maxs SimpleITK takes the origin half a voxel on (though no `centers` field asks for
# that), but a spacing of 1, 1, 1; pyvista has origin 0 and spacing 1. With mins and spacings SimpleITK has the
# spacing; pyvista reads every second number of it, 0.5, 2, 1, and still origin 0. No warning.
# Why it matters: volumes from older tools (unu, teem) come out at another size or off the phantom.
# Instead: read the header with pynrrd and decide, or refuse a file without `space directions`.
#
# Seen:
#   mins and maxs     SimpleITK origin (10.25, 20.25, 31.0) spacing (1.0, 1.0, 1.0)
#                     pyvista   origin (0.0, 0.0, 0.0) spacing (1.0, 1.0, 1.0)
#   mins and spacings SimpleITK origin (10.25, 20.25, 31.0) spacing (0.5, 0.5, 2.0)
#                     pyvista   origin (0.0, 0.0, 0.0) spacing (0.5, 2.0, 1.0)
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet SimpleITK==2.5.7 pyvista==0.49.1 vtk==9.7.2 numpy==2.4.6

venv/bin/python - <<'PYTHON'
from pathlib import Path

import pyvista as pv
import SimpleITK as sitk

HEADER = """NRRD0004
type: uchar
dimension: 3
sizes: 4 5 6
axis mins: 10 20 30
{extent}
encoding: raw

"""
seen = {}
for name, extent in {"mins and maxs": "axis maxs: 12 22.5 42", "mins and spacings": "spacings: 0.5 0.5 2"}.items():
    Path("volume.nrrd").write_bytes(HEADER.format(extent=extent).encode() + bytes(120))
    image, grid = sitk.ReadImage("volume.nrrd"), pv.read("volume.nrrd")
    in_pyvista = tuple(map(float, grid.origin)), tuple(map(float, grid.spacing))
    seen[name] = (image.GetOrigin(), image.GetSpacing(), *in_pyvista)
    print(f"{name:17s} SimpleITK origin {seen[name][0]} spacing {seen[name][1]}")
    print(f"{'':17s} pyvista   origin {seen[name][2]} spacing {seen[name][3]}")
half, zero, one = (10.25, 20.25, 31.0), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
if seen["mins and maxs"] != (half, one, zero, one):
    raise SystemExit("changed: axis mins and maxs are read differently")
if seen["mins and spacings"] != (half, (0.5, 0.5, 2.0), zero, (0.5, 2.0, 1.0)):
    raise SystemExit("changed: axis mins and spacings are read differently")
PYTHON
