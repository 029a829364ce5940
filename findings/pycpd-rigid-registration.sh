#!/usr/bin/env bash
# pycpd 2.0.0: "rigid" registration scales, and its R is the transpose
#
# Expected: `RigidRegistration` gives a rotation R and a translation t with x = R y + t, as in the paper that it
# names (Myronenko and Song 2010), and rigid means without scale.
# What happens: R is for points as rows, x = s (y R) + t, so R is the transpose of the rotation: +30 deg is reported
# as -30 deg. A scale s is always estimated and cannot be switched off: a phantom that swelled by 3 % registers
# without any residual.
# Why it matters: pose of a phantom or an organ from a surface scan; the wrong sign of the rotation goes unnoticed
# for small angles, and the swelling that one wants to see is taken away.
# Instead: use R.T, look at s, or fit a rigid motion by Kabsch/Horn (scipy `Rotation.align_vectors`).
#
# Seen:
#   rotation: true +30.0 deg, reported -30.0 deg
#   largest residual: R y + t 3.11, y R + t 0.00
#   swollen by 3 %: scale 1.030, largest residual 0.0000
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet pycpd==2.0.0 scipy==1.17.1 numpy==2.4.6

venv/bin/python - <<'PYTHON'
import warnings

import numpy as np
from scipy.spatial.transform import Rotation

warnings.simplefilter("ignore")
from pycpd import RigidRegistration

rng = np.random.default_rng(0)
source = rng.normal(size=(80, 3))
rotation = Rotation.from_euler("z", 30, degrees=True).as_matrix()
translation = np.array([0.1, 0.2, 0.3])
target = source @ rotation.T + translation


def register(points):
    moved, parameters = RigidRegistration(X=points, Y=source, max_iterations=300, tolerance=1e-9).register()
    return moved, *parameters


_, _, R, t = register(target)
angle = Rotation.from_matrix(R).as_rotvec(degrees=True)[2]
as_columns = np.abs(source @ R.T + t - target).max()
as_rows = np.abs(source @ R + t - target).max()
print(f"rotation: true +30.0 deg, reported {angle:+.1f} deg")
print(f"largest residual: R y + t {as_columns:.2f}, y R + t {as_rows:.2f}")

swollen = 1.03 * target
moved, scale, _, _ = register(swollen)
residual = np.abs(moved - swollen).max()
print(f"swollen by 3 %: scale {scale:.3f}, largest residual {residual:.4f}")
if not (np.isclose(angle, -30) and as_columns > 1 and as_rows < 1e-6):
    raise SystemExit("changed: R is no longer the transpose")
if not (np.isclose(scale, 1.03) and residual < 1e-6):
    raise SystemExit("changed: the rigid registration no longer scales")
PYTHON
