#!/usr/bin/env bash
# muDIC 0.2.1 (digital image correlation): the Green-Lagrange strain turns with the specimen
#
# Expected: `Fields.green_strain()` is E = (F^T F - I) / 2, as its docstring says ("Green Lagrange strain tensor"), so
# that a specimen which is stretched and then turned has the strain of the stretch, and no shear.
# What happens: it is (F F^T - I) / 2, which turns with the specimen: stretched by 10 % and turned by 10 deg it has a
# shear of 0.026. In simple shear the second-order strain stands on the other axis. `fields.F()` is right;
# `eng_strain()` and `true_strain()` are computed from the wrong tensor.
# Why it matters: strain energies and fibre directions belong to the reference, F^T F. Shear that looks like anisotropy
# of the tissue comes in as soon as a clamp askew or the camera lets the specimen turn.
# Instead: take `fields.F()` and form E yourself.
#
# Pictures are made with the package's own deformer: a speckle pattern stretched along x and turned, in five steps.
#
# Seen:
#   stretched, turned: largest error of F 0.0001
#     green_strain()       xx +0.1003, yy -0.0408, xy +0.0257
#     (F^T F - I) / 2      xx +0.1049, yy -0.0454, xy +0.0000
#     (F F^T - I) / 2      xx +0.1003, yy -0.0408, xy +0.0257
#   simple shear: largest error of F 0.0000
#     green_strain()       xx +0.0200, yy -0.0000, xy +0.1000
#     (F^T F - I) / 2      xx +0.0000, yy +0.0200, xy +0.1000
#     (F F^T - I) / 2      xx +0.0200, yy -0.0000, xy +0.1000
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet muDIC==0.2.1 scipy==1.17.1 scikit-image==0.26.0 numba==0.68.1 numpy==2.4.6

venv/bin/python - <<'PYTHON'
import contextlib
import logging

import numpy as np

with contextlib.redirect_stdout(None):
    import muDIC
    from muDIC import vlab

logging.disable(logging.CRITICAL)
np.random.seed(0)
STEPS = 5


def turned_stretch(part, stretch=1.1, turn_deg=10.0):
    """Deformation gradient: an incompressible stretch along x, then a turn."""
    along, angle = 1 + part * (stretch - 1), np.radians(part * turn_deg)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return turn @ np.diag([along, along**-0.5])


def simple_shear(part, amount=0.2):
    return np.array([[1.0, part * amount], [0.0, 1.0]])


def measured(deformation):
    """Mean F and Green-Lagrange strain of the last picture, by correlation."""
    speckle = vlab.rosta_speckle((200, 200), dot_size=4, density=0.32, smoothness=2.0)
    pictures = [speckle]
    for step in range(1, STEPS + 1):
        pictures.append(vlab.imageDeformer_from_defGrad(deformation(step / STEPS))(speckle, steps=2)[1])
    stack = muDIC.image_stack_from_list(pictures)
    mesh = muDIC.Mesher(deg_e=1, deg_n=1, type="q4").mesh(
        stack, Xc1=70, Xc2=130, Yc1=70, Yc2=130, n_elx=2, n_ely=2, GUI=False
    )
    fields = muDIC.Fields(muDIC.DICAnalysis(muDIC.DICInput(mesh, stack)).run())
    return [values[0, :, :, :, :, -1].mean((2, 3)) for values in (fields.F(), fields.green_strain())]


def shown(name, strain):
    print(f"  {name:20s} xx {strain[0, 0]:+.4f}, yy {strain[1, 1]:+.4f}, xy {strain[0, 1]:+.4f}")


for name, deformation in {"stretched, turned": turned_stretch, "simple shear": simple_shear}.items():
    F, strain = measured(deformation)
    print(f"{name}: largest error of F {np.abs(F - deformation(1)).max():.4f}")
    right, left = (F.T @ F - np.eye(2)) / 2, (F @ F.T - np.eye(2)) / 2
    shown("green_strain()", strain)
    shown("(F^T F - I) / 2", right)
    shown("(F F^T - I) / 2", left)
    if np.allclose(strain, right, atol=1e-3) or not np.allclose(strain, left, atol=1e-3):
        raise SystemExit("changed: the Green strain is no longer (F F^T - I) / 2")
PYTHON
