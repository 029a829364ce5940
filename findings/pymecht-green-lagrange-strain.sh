#!/usr/bin/env bash
# pymecht 1.1.3: "Green-Lagrange strain" as input is taken with another formula
#
# Expected: `UniaxialExtension` and `PlanarBiaxialExtension` with disp_measure="strain" ("The Green-Lagrange strain")
# take E = (stretch^2 - 1) / 2, so stretch = sqrt(2 E + 1).
# What happens: they compute stretch = sqrt(E) + 1. A strain of 0.105 (stretch 1.1) is loaded as stretch 1.32, one of
# 0.01 as 1.10; below that the extension is more than ten times too large. No warning. (Negative strains raise a
# domain error.)
# Why it matters: planar biaxial data of soft tissue are commonly given in Green-Lagrange strain. A fit to them is
# of the wrong shape and gives a third of the stiffness.
# Instead: convert to stretch first and use disp_measure="stretch".
#
# PyTorch, of which the package only uses a generator of quasi-random numbers, is not installed (over 1 GB); a
# stand-in of its name takes its place. The package needs Python 3.11 or 3.12.
#
# Seen:
#   stretch 1.01, E 0.0101:  0.30 kPa by stretch,  3.02 by strain;  3.02 at stretch 1.100
#   stretch 1.05, E 0.0513:  1.50 kPa by stretch,  6.89 by strain;  6.89 at stretch 1.226
#   stretch 1.10, E 0.1050:  3.01 kPa by stretch,  9.98 by strain;  9.98 at stretch 1.324
#   stretch 1.20, E 0.2200:  6.07 kPa by stretch, 14.77 by strain; 14.77 at stretch 1.469
#   shear modulus fitted to these strains and stresses: 3.5 kPa, true 10.0 kPa
#   planar, stretch 1.10 both ways: 5.27 kPa by stretch, 14.28 by strain
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 pyDOE==0.9.5 tqdm==4.70.1
venv/bin/pip install --quiet --no-deps pymecht==1.1.3

venv/bin/python - <<'PYTHON'
import sys
import types

import numpy as np

sys.modules["torch.quasirandom"] = types.SimpleNamespace(SobolEngine=None)
import pymecht

SHEAR_MODULUS_KPA = 10.0


def tissue():
    """Incompressible neo-Hookean: Cauchy stress mu (stretch^2 - 1 / stretch) in a uniaxial test."""
    return pymecht.MatModel("nh")


def stress_kpa(sample, given, shear_modulus_kpa=SHEAR_MODULUS_KPA):
    parameters = sample.parameters
    parameters.set("mu_0", shear_modulus_kpa)
    return sample.disp_controlled(given, parameters)


by_stretch = pymecht.UniaxialExtension(tissue(), disp_measure="stretch", force_measure="cauchy")
by_strain = pymecht.UniaxialExtension(tissue(), disp_measure="strain", force_measure="cauchy")
stretch = np.array([1.01, 1.05, 1.1, 1.2])
strain = (stretch**2 - 1) / 2
right, got = stress_kpa(by_stretch, stretch), stress_kpa(by_strain, strain)
taken = np.sqrt(strain) + 1
for row in zip(stretch, strain, right, got, stress_kpa(by_stretch, taken), taken, strict=True):
    print("stretch {:.2f}, E {:.4f}: {:5.2f} kPa by stretch, {:5.2f} by strain; {:5.2f} at stretch {:.3f}".format(*row))

per_kpa = stress_kpa(by_strain, strain, 1.0)
fitted = float(per_kpa @ right / (per_kpa @ per_kpa))
print(f"shear modulus fitted to these strains and stresses: {fitted:.1f} kPa, true {SHEAR_MODULUS_KPA:.1f} kPa")

planar_stretch = pymecht.PlanarBiaxialExtension(tissue(), disp_measure="stretch", force_measure="cauchy")
planar_strain = pymecht.PlanarBiaxialExtension(tissue(), disp_measure="strain", force_measure="cauchy")
pair = np.array([[1.1, 1.1]])
planar_right, planar_got = stress_kpa(planar_stretch, pair), stress_kpa(planar_strain, (pair**2 - 1) / 2)
print(f"planar, stretch 1.10 both ways: {planar_right[0, 0]:.2f} kPa by stretch, {planar_got[0, 0]:.2f} by strain")
if np.allclose(got, right) or np.allclose(planar_got, planar_right):
    raise SystemExit("changed: the strain is Green-Lagrange's")
if not np.allclose(got, stress_kpa(by_stretch, taken)):
    raise SystemExit("changed: the strain is taken by another formula than sqrt(E) + 1")
PYTHON
