#!/usr/bin/env bash
# SimpleITK 2.5.7: volume change and inverse of a displacement field depend on the direction of its grid
#
# Expected: displacements are vectors in physical space, so a field on a grid of other direction cosines describes the
# same motion; `DisplacementFieldJacobianDeterminant` and `InverseDisplacementField` give the same for it.
# What happens: the determinant takes differences along the axes of the grid as if they were x, y, z. With x and y
# reversed, which is what a volume stored as RAS has in ITK, tissue that keeps its volume is reported to lose 18 %. The
# inverse (thin-plate spline) has its landmarks off the grid, and is 5 mm wrong where the displacement is 0.5 mm.
# Neither warns. The two other inversions of SimpleITK are right.
# Why it matters: volumetric strain of an organ from a registration is this determinant; it turns its sign with the
# orientation in which the scanner, or the converter to NIfTI, stored the rows.
# Instead: turn the field with `DICOMOrient` first (as below; for oblique grids resample to an identity direction),
# or take `numpy.gradient` and divide by the direction; `InvertDisplacementField` for the inverse.
# Mended in ITK for the determinant (2025) and the spline (2026), not yet in this release.
#
# One homogeneous motion with displacements u = A x, on three grids of 2 mm.
#
# Seen:
#   axial                   determinant 1.003 for 1.003; error of the inverse 0.0 mm, by iteration 0.0 mm, of 0.6 mm
#   axial, x and y reversed determinant 0.821 for 1.003; error of the inverse 5.2 mm, by iteration 0.0 mm, of 0.5 mm
#   sagittal                determinant 1.038 for 1.003; error of the inverse 7.1 mm, by iteration 0.0 mm, of 0.6 mm
#   axial, x and y reversed, then DICOMOrient: determinant 1.003
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet SimpleITK==2.5.7 numpy==2.4.6

venv/bin/python - <<'PYTHON'
import numpy as np
import SimpleITK as sitk

NODES, SPACING_MM, PROBE = 24, 2.0, [13, 15, 10]
GRADIENT = np.array([[0.08, 0.03, 0.0], [0.0, 0.02, 0.04], [0.05, 0.0, -0.09]])  # of the displacement
DIRECTIONS = {
    "axial": np.eye(3),
    "axial, x and y reversed": np.diag([-1.0, -1.0, 1.0]),
    "sagittal": np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]),
}


def field_on(direction):
    """The motion on a grid whose centre is the origin."""
    image = sitk.Image([NODES] * 3, sitk.sitkVectorFloat64, 3)
    image.SetSpacing([SPACING_MM] * 3)
    image.SetDirection(direction.ravel())
    image.SetOrigin(-SPACING_MM * (NODES - 1) / 2 * direction.sum(1))
    index = np.stack(np.meshgrid(*[np.arange(NODES)] * 3, indexing="ij"), -1)[..., ::-1]  # stored as k, j, i
    points = SPACING_MM * index @ direction.T + image.GetOrigin()
    field = sitk.GetImageFromArray(points @ GRADIENT.T, isVector=True)
    field.CopyInformation(image)
    return field


def determinant(field):
    return sitk.DisplacementFieldJacobianDeterminant(field).GetPixel(*PROBE)


def error_mm(inverse):
    """Distance of the inverse at the probe from the exact one."""
    point = np.array(inverse.TransformIndexToPhysicalPoint(PROBE))
    exact = np.linalg.solve(np.eye(3) + GRADIENT, point) - point
    return float(np.linalg.norm(inverse.GetPixel(*PROBE) - exact)), float(np.linalg.norm(exact))


exact = np.linalg.det(np.eye(3) + GRADIENT)
seen = {}
for name, direction in DIRECTIONS.items():
    field = field_on(direction)
    spline = sitk.InverseDisplacementField(field, field.GetSize(), field.GetOrigin(), field.GetSpacing(), 4)
    fixed_point = sitk.InvertDisplacementField(field, 50, 1e-4, 1e-5)
    (by_spline, size), (by_iteration, _) = error_mm(spline), error_mm(fixed_point)
    seen[name] = determinant(field), by_spline
    print(
        f"{name:23s} determinant {seen[name][0]:.3f} for {exact:.3f}; error of the inverse {by_spline:.1f} mm,"
        f" by iteration {by_iteration:.1f} mm, of {size:.1f} mm"
    )
oriented = determinant(sitk.DICOMOrient(field_on(DIRECTIONS["axial, x and y reversed"]), "LPS"))
print(f"axial, x and y reversed, then DICOMOrient: determinant {oriented:.3f}")
if not (np.isclose(seen["axial"][0], exact) and np.isclose(oriented, exact)):
    raise SystemExit("changed: the determinant is wrong on a grid along x, y, z, too")
if all(np.isclose(value, exact) for value, _ in seen.values()):
    raise SystemExit("changed: the determinant no longer depends on the direction of the grid")
if seen["axial, x and y reversed"][1] < 1:
    raise SystemExit("changed: the spline's inverse no longer depends on the direction of the grid")
PYTHON
