#!/usr/bin/env bash
# felupe 11.3.0: the Blatz-Ko law is twice as stiff as its parameter says
#
# Expected: `blatz_ko` has the energy of its docstring, (mu / 2) (I2 / I3 + 2 sqrt(I3) - 5), whose shear modulus is mu
# and whose Young's modulus is 2.5 mu (the docstring gives mu = 2 E / 5), at Poisson's ratio 0.25.
# What happens: the half is missing. The shear modulus is 2 mu, Young's modulus 5 mu, and every stress is doubled;
# Poisson's ratio is right. The laws beside it (neo-Hooke, Ogden, Storakers) have the shear modulus that they name.
# Documented: the other way, see above. Nothing warns.
# Why it matters: Blatz-Ko is the usual law for a foamed, compressible phantom. A body simulated with a measured mu
# pushes back with twice the force, and a fit returns half the modulus.
# Instead: give mu / 2 and double what a fit returns; or take `storakers` with mu=[mu], alpha=[-2], beta=[0.5], which is
# the same law.
#
# Seen:
#   given mu 10 kPa                  shear modulus 10.0 kPa, Young's 25.0 kPa, Poisson's ratio 0.25
#   blatz_ko(mu=10)                  shear modulus 20.0 kPa, Young's 50.0 kPa, Poisson's ratio 0.25
#   storakers, the same law          shear modulus 10.0 kPa, Young's 25.0 kPa, Poisson's ratio 0.25
#   stress at stretch 1.3, sides held: 5.45 kPa by the docstring, 10.90 by blatz_ko, 5.45 by storakers
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet felupe==11.3.0 tensortrax==0.29.0 numpy==2.4.6 scipy==1.17.1

venv/bin/python - <<'PYTHON'
import numpy as np
from felupe.constitution.tensortrax import Hyperelastic
from felupe.constitution.tensortrax.models import hyperelastic

MU_KPA, SMALL, STRETCH = 10.0, 1e-4, 1.3


def stress_kpa(material, deformation_gradient):
    """First Piola-Kirchhoff stress at one point."""
    return material.gradient([deformation_gradient[:, :, None, None], None])[0][:, :, 0, 0]


def moduli(material):
    """Shear modulus and Young's modulus in kPa, and Poisson's ratio, at small strain."""
    shear = stress_kpa(material, np.eye(3) + SMALL * np.eye(3)[:, [1]] @ np.eye(3)[[0]])[1, 0] / SMALL
    lame = stress_kpa(material, np.diag([1 + SMALL, 1, 1]))[1, 1] / SMALL
    return shear, shear * (3 * lame + 2 * shear) / (lame + shear), lame / (lame + shear) / 2


def told(name, values):
    print("{:32s} shear modulus {:.1f} kPa, Young's {:.1f} kPa, Poisson's ratio {:.2f}".format(name, *values))


blatz_ko = Hyperelastic(hyperelastic.blatz_ko, mu=MU_KPA)
storakers = Hyperelastic(hyperelastic.storakers, mu=[MU_KPA], alpha=[-2.0], beta=[0.5])
told(f"given mu {MU_KPA:.0f} kPa", (MU_KPA, 2.5 * MU_KPA, 0.25))
told(f"blatz_ko(mu={MU_KPA:.0f})", moduli(blatz_ko))
told("storakers, the same law", moduli(storakers))

# sides held: I2 / I3 = 2 + stretch^-2 and sqrt(I3) = stretch
documented = MU_KPA / 2 * (2 - 2 * STRETCH**-3)
got, same = (stress_kpa(material, np.diag([STRETCH, 1, 1]))[0, 0] for material in (blatz_ko, storakers))
print(
    f"stress at stretch {STRETCH}, sides held: {documented:.2f} kPa by the docstring, "
    f"{got:.2f} by blatz_ko, {same:.2f} by storakers"
)
if np.isclose(got, documented):
    raise SystemExit("changed: the stress is that of the docstring")
if not (np.isclose(got, 2 * documented) and np.isclose(same, documented)):
    raise SystemExit("changed: the stress is neither that of the docstring nor twice that")
PYTHON
