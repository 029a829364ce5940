#!/usr/bin/env bash
# EasyFEA 7.1.0: what each hyperelastic law calls "Bulk modulus" is another quantity
#
# Expected: parameter K, "Bulk modulus" in the docstring of each law, is the ratio of pressure to loss of volume.
# What happens, for small strain:
#   - `NeoHookean(K)` has the energy K (I1 J^(-2/3) - 3): the shear modulus is 2 K and the bulk modulus is 0, so that
#     its volume may change freely, and there is no parameter with which to stop it;
#   - `MooneyRivlin` has K (J - 1)^2, bulk modulus 2 K;
#   - `SaintVenantKirchhoff` adds K (J^2 - 1)^2 / 2, that is 4 K, to the lambda + 2 mu / 3 that it has already;
#   - `CiarletGeymonat` and `HolzapfelOgden` have K.
# Documented: "Bulk modulus" for all five; the energies stand in the code only. Nothing warns.
# Why it matters: soft tissue is nearly incompressible, and its K comes from literature or from E and nu. The same K
# gives 0 to 4 times as much, and one that was fitted with a law is wrong for the next. A neo-Hookean body that is given
# its bulk modulus is far too stiff in shear, and gives way to pressure without resistance.
# Instead: MooneyRivlin(K1=mu / 2, K2=0, K=kappa / 2) is the neo-Hookean law with shear modulus mu and bulk modulus
# kappa; leave K of SaintVenantKirchhoff at 0.
#
# One brick is blown up by a ratio of 1 + 1e-5 and sheared by 1e-5; second Piola-Kirchhoff stress by each law.
#
# Seen:
#   told K = 10 kPa
#   NeoHookean            bulk modulus   0.0 kPa, shear modulus 20.0 kPa
#   MooneyRivlin          bulk modulus  20.0 kPa, shear modulus  3.0 kPa
#   SaintVenantKirchhoff  bulk modulus  42.0 kPa, shear modulus  3.0 kPa
#   CiarletGeymonat       bulk modulus  10.0 kPa, shear modulus  3.0 kPa
#   HolzapfelOgden        bulk modulus  10.0 kPa, shear modulus  3.0 kPa
#   NeoHookean, pressed to half its volume: stress 0.0 kPa
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet EasyFEA==7.1.0 gmsh==4.15.2 matplotlib==3.11.2 scipy==1.17.1 numpy==2.4.6

MPLBACKEND=Agg venv/bin/python - <<'PYTHON'
import numpy as np
from EasyFEA import ElemType
from EasyFEA.FEM import Kinematics
from EasyFEA.Geoms import Domain, Point
from EasyFEA.Models import HyperElastic

BULK_KPA, SMALL = 10.0, 1e-5
#: Position of each component in the vector of a law: xx, yy, zz, sqrt(2) yz, sqrt(2) xz, sqrt(2) xy.
XX, YY, ZZ, XY = 0, 1, 2, 5

brick = Domain(Point(), Point(1, 1), 1.0).Mesh_Extrude([], [0, 0, 1], [1], ElemType.HEXA8, isOrganised=True)


def stress_kpa(law, gradient):
    """Second Piola-Kirchhoff stress at one point of the brick, for a uniform displacement gradient."""
    displacement = brick.coord @ np.transpose(gradient)
    return np.asarray(law.Compute_dWde(Kinematics(brick.groupElem, displacement.ravel())))[0, 0]


def moduli_kpa(law):
    """Bulk modulus and shear modulus at small strain."""
    blown_up = stress_kpa(law, SMALL * np.eye(3))
    sheared = stress_kpa(law, SMALL * np.eye(3)[:, [0]] @ np.eye(3)[[1]])
    return blown_up[[XX, YY, ZZ]].mean() / (3 * SMALL), sheared[XY] / np.sqrt(2) / SMALL


laws = {
    "NeoHookean": HyperElastic.NeoHookean(3, K=BULK_KPA),
    "MooneyRivlin": HyperElastic.MooneyRivlin(3, K1=1.0, K2=0.5, K=BULK_KPA),
    "SaintVenantKirchhoff": HyperElastic.SaintVenantKirchhoff(3, lmbda=0.0, mu=3.0, K=BULK_KPA),
    "CiarletGeymonat": HyperElastic.CiarletGeymonat(3, K1=1.0, K2=0.5, K=BULK_KPA),
    "HolzapfelOgden": HyperElastic.HolzapfelOgden(
        3, *np.zeros(8), K=BULK_KPA, Mu1=1.0, Mu2=0.5, T1=np.array([1.0, 0, 0]), T2=np.array([0, 1.0, 0])
    ),
}
print(f"told K = {BULK_KPA:.0f} kPa")
bulk_kpa = {}
for name, law in laws.items():
    bulk_kpa[name], shear_kpa = moduli_kpa(law)
    print(f"{name:21s} bulk modulus {bulk_kpa[name] + 0.0:5.1f} kPa, shear modulus {shear_kpa:4.1f} kPa")

halved = stress_kpa(laws["NeoHookean"], (0.5 ** (1 / 3) - 1) * np.eye(3))[[XX, YY, ZZ]]
print(f"NeoHookean, pressed to half its volume: stress {np.abs(halved).max():.1f} kPa")
expected = {
    "NeoHookean": 0,
    "MooneyRivlin": 2 * BULK_KPA,
    "SaintVenantKirchhoff": 2 + 4 * BULK_KPA,
    "CiarletGeymonat": BULK_KPA,
    "HolzapfelOgden": BULK_KPA,
}
for name, value in expected.items():
    if not np.isclose(bulk_kpa[name], value, rtol=1e-3, atol=1e-3):
        raise SystemExit(f"changed: the bulk modulus of {name} is {bulk_kpa[name]:.2f} kPa")
PYTHON
