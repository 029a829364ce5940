#!/usr/bin/env bash
# MuJoCo 4.0.0: a flex with fewer degrees of freedom has another constitutive law
#
# Expected: `dof="trilinear"` and `dof="quadratic"` of a flexcomp choose how freely it deforms ("affects the
# deformation modes", says the reference, and calls them the preferred choice where the modes suffice). A homogeneous
# stretch is exact in all three, so the stress is the same; "the elasticity model is a Saint Venant-Kirchhoff model".
# What happens: that is so for `dof="full"` only. The other two have the corotational linear law, engineering strain
# instead of Green's. Pressed to 0.7 of its height, the same block (same young, poisson, mesh) is 1.7 times as stiff;
# stretched to 1.3 it has two thirds of the stress. Nothing warns.
# Why it matters: pads and organs are pressed, not pulled, and are changed to trilinear to make them fast: a modulus
# fitted with one is wrong in the other, at any resolution.
# Instead: fit and use with the same `dof`; compare stress and stretch of one block before changing it.
#
# Block of 100 mm, 10 kPa, Poisson's ratio 0.45. Affine motion of all vertices; the stress is the virial of the
# passive forces at rest, and the width is the one at which the sides are free of stress.
#
# Seen:
#   stretch                         0.50    0.60    0.70    0.90    1.10    1.30
#   full      stress (kPa)         -1.88   -1.92   -1.79   -0.86   +1.15   +4.49
#   trilinear stress (kPa)         -5.00   -4.00   -3.00   -1.00   +1.00   +3.00
#   quadratic stress (kPa)         -5.00   -4.00   -3.00   -1.00   +1.00   +3.00
#   Saint Venant-Kirchhoff         -1.88   -1.92   -1.78   -0.85   +1.16   +4.49
#   corotational linear            -5.00   -4.00   -3.00   -1.00   +1.00   +3.00
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet mujoco==4.0.0 scipy==1.17.1 numpy==2.4.6

venv/bin/python - <<'PYTHON'
import mujoco
import numpy as np
from scipy.optimize import brentq

YOUNG, POISSON, SIDE = 1e4, 0.45, 0.1
BLOCK = """
<mujoco>
  <option gravity="0 0 0"/>
  <worldbody>
    <flexcomp name="block" type="grid" dim="3" count="5 5 5" spacing="0.025 0.025 0.025" mass="1" radius="0.0005"
              dof="{dof}">
      <contact selfcollide="none"/>
      <elasticity young="{young}" poisson="{poisson}" damping="0.01"/>
    </flexcomp>
  </worldbody>
</mujoco>
"""
STRETCHES = (0.5, 0.6, 0.7, 0.9, 1.1, 1.3)


class Block:
    """A block whose nodes (vertices, or nodes of the interpolation) have three slides each."""

    def __init__(self, dof):
        self.model = mujoco.MjModel.from_xml_string(BLOCK.format(dof=dof, young=YOUNG, poisson=POISSON))
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        bodies = self.model.jnt_bodyid[::3]
        self.rest = self.data.flexvert_xpos.copy()
        self.nodes = self.data.xpos[bodies].copy()

    def stress(self, stretch, width):
        """First Piola-Kirchhoff stress (Pa) at x and y times width, z times stretch."""
        gradient = np.diag([width, width, stretch])
        self.data.qpos[:] = (self.nodes @ (gradient - np.eye(3)).T).ravel()
        mujoco.mj_forward(self.model, self.data)
        assert np.allclose(self.data.flexvert_xpos, self.rest @ gradient.T)  # the motion is exact
        return -self.data.qfrc_passive.reshape(-1, 3).T @ self.nodes / SIDE**3

    def uniaxial(self, stretch):
        """Force over the first area (Pa), with free sides."""
        width = brentq(lambda width: self.stress(stretch, width)[0, 0], 0.8, 1.4)
        return self.stress(stretch, width)[2, 2]


blocks = {dof: Block(dof) for dof in ("full", "trilinear", "quadratic")}
seen = {dof: np.array([block.uniaxial(stretch) for stretch in STRETCHES]) for dof, block in blocks.items()}
print("stretch                     " + "".join(f"{stretch:8.2f}" for stretch in STRETCHES))
for dof, stress in seen.items():
    print(f"{dof:9s} stress (kPa)      " + "".join(f"{value / 1e3:+8.2f}" for value in stress))
stretch = np.array(STRETCHES)
laws = {
    "Saint Venant-Kirchhoff": YOUNG * stretch * (stretch**2 - 1) / 2,
    "corotational linear": YOUNG * (stretch - 1),
}
for name, stress in laws.items():
    print(f"{name:27s} " + "".join(f"{value / 1e3:+8.2f}" for value in stress))
if any(np.allclose(stress, seen["full"], rtol=1e-3) for dof, stress in seen.items() if dof != "full"):
    raise SystemExit("changed: the law is the same for all degrees of freedom")
if not np.allclose(seen["full"], laws["Saint Venant-Kirchhoff"], rtol=1e-3):
    raise SystemExit("changed: the full flex is no longer Saint Venant-Kirchhoff")
if not all(np.allclose(seen[dof], laws["corotational linear"], rtol=1e-3) for dof in ("trilinear", "quadratic")):
    raise SystemExit("changed: the interpolated flex no longer has the corotational law")
PYTHON
