#!/usr/bin/env bash
# gpytoolbox 0.3.8: von Mises stresses that are 29 % low, and loads that vanish on a finer mesh
#
# Expected: `linear_elasticity` returns "per-element Von Mises stresses", and takes "external forces (for example,
# gravity or a load)", a row for each vertex.
# What happens:
#   - the stress is sqrt((sxx^2 - sxx syy + syy^2 + 3 sxy^2) / 2). The half does not belong there, so that every value
#     is 0.71 of the right one: pure shear of 1 kPa gives 1.22 kPa for 1.73. (The strain is plane, but the stress across
#     the plane is left out too.)
#   - a force is multiplied by the mass of its vertex, that is by its share of the area at density 1, as if it were an
#     acceleration. The same pull on a mesh twice as fine stretches a plate a quarter as much.
# Documented: the other way, see above. The stiffness matrix itself is right. Nothing warns.
# Why it matters: a measured force is put on the vertices that the gripper holds; a fit of the stiffness to it returns
# a number that depends on the mesh. Von Mises stress is what is compared with the strength of tissue.
# Instead: take the matrices of `linear_elasticity_stiffness` and solve K u = f; compute stresses from its C and strain.
#
# A plate of 1 m x 1 m x 1 m, shear modulus 10 kPa, Poisson's ratio 0, left edge held, at rest (one step of 1e6 s).
#
# Seen:
#   sheared by 0.1:      von Mises stress 1.22 kPa, by hand 1.73
#   stretched by 0.1:    von Mises stress 1.41 kPa, by hand 2.00
#   pulled with 1 kN,  5 vertices an edge: 1.34 mm longer, by hand 50.00
#   pulled with 1 kN,  9 vertices an edge: 0.36 mm longer, by hand 50.00
#   pulled with 1 kN, 17 vertices an edge: 0.09 mm longer, by hand 50.00
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet gpytoolbox==0.3.8 scipy==1.17.1 numpy==2.4.6

venv/bin/python - <<'PYTHON'
import numpy as np
from gpytoolbox import linear_elasticity, regular_square_mesh

SHEAR_KPA, PULL_KN, LONG_S = 10.0, 1.0, 1e6
#: Bulk modulus 2/3 of the shear modulus: Poisson's ratio 0, Young's modulus twice the shear modulus.
LAW = {"K": 2 / 3 * SHEAR_KPA, "mu": SHEAR_KPA}


def plate(count):
    """Vertices in m and triangles of a plate with `count` vertices along an edge."""
    vertices, triangles = regular_square_mesh(count)
    return (vertices + 1) / 2, triangles


def von_mises_kpa(displacement_gradient):
    """Mean stress when all edges follow a uniform displacement gradient."""
    vertices, triangles = plate(5)
    edge = np.flatnonzero(np.any(np.isclose(vertices, 0) | np.isclose(vertices, 1), axis=1))
    moved = vertices[edge] @ np.transpose(displacement_gradient)
    _, stress = linear_elasticity(vertices, triangles, 0 * vertices, dt=LONG_S, bb=edge, bc=moved, **LAW)
    return float(np.mean(stress))


def elongation_mm(count):
    """Mean displacement of the right edge, which is pulled with an even load."""
    vertices, triangles = plate(count)
    left, right = (np.flatnonzero(np.isclose(vertices[:, 0], side)) for side in (0, 1))
    force = np.zeros_like(vertices)
    force[right, 0] = PULL_KN / (count - 1)
    force[right[np.isclose(vertices[right, 1] % 1, 0)], 0] /= 2  # the corners have half a side
    moved, _ = linear_elasticity(
        vertices, triangles, 0 * vertices, dt=LONG_S, bb=left, bc=0 * vertices[left], fext=force, **LAW
    )
    return float(np.mean(np.reshape(moved, (-1, 2), order="F")[right, 0]) * 1e3)


sheared, stretched = von_mises_kpa([[0, 0.1], [0, 0]]), von_mises_kpa([[0.1, 0], [0, 0]])
right_sheared, right_stretched = np.sqrt(3) * SHEAR_KPA * 0.1, 2 * SHEAR_KPA * 0.1
print(f"sheared by 0.1:      von Mises stress {sheared:.2f} kPa, by hand {right_sheared:.2f}")
print(f"stretched by 0.1:    von Mises stress {stretched:.2f} kPa, by hand {right_stretched:.2f}")
right_mm = PULL_KN / (2 * SHEAR_KPA) * 1e3
elongations_mm = {count: elongation_mm(count) for count in (5, 9, 17)}
for count, got_mm in elongations_mm.items():
    print(f"pulled with 1 kN, {count:2d} vertices an edge: {got_mm:.2f} mm longer, by hand {right_mm:.2f}")

if np.isclose(sheared, right_sheared) or np.isclose(stretched, right_stretched):
    raise SystemExit("changed: the stress is von Mises'")
if not np.allclose([sheared, stretched], np.array([right_sheared, right_stretched]) / np.sqrt(2)):
    raise SystemExit("changed: the stress is neither von Mises' nor 0.71 of it")
if elongations_mm[17] > 0.1 * elongations_mm[5]:
    raise SystemExit("changed: the effect of a load no longer vanishes on a finer mesh")
PYTHON
