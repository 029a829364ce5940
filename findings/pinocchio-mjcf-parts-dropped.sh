#!/usr/bin/env bash
# Pinocchio 4.1.0: an MJCF model without some of its parts, and with links turned otherwise than in MuJoCo
#
# Expected: `buildModelFromMJCF` gives the mechanism of the file, or refuses where it cannot, as it does for a shell
# inertia.
# What happens:
#   - `<frame>` and `<include>` are skipped with all that is in them: bodies, joints and mass are missing;
#   - capital letters of `eulerseq` (angles about axes that stay, as in URDF) are read as small ones (axes that move
#     along), so the same three angles give another orientation;
#   - `axisangle` is not normalised: with an axis of length 2 the "rotation" stretches all that is behind it;
#   - `inertiagrouprange` is not heeded: geoms that are only drawn have mass.
# Documented: "Parse the MJCF file given in input"; that anything is left out is not said. Nothing warns.
# Why it matters: gravity compensation takes the weight of arm and tool off a measured force, and kinematics place the
# tool. "XYZ" is how MJCF spells the roll, pitch and yaw of URDF; arm and gripper are often joined with `<include>`.
# Instead: give it files without these: includes pasted in, frames worked into the bodies, quaternions for angles, an
# <inertial> in every body. Compare number of joints, mass and tool pose with MuJoCo before use.
#
# One small arm with two joints, written in six ways, read by both; place of the tool in mm with all joints at 0.
#
# Seen:
#                    MuJoCo                                  Pinocchio
#   plain            joints 2, 1.0 kg, (+100,   +0, +200)     joints 2, 1.0 kg, (+100,   +0, +200)
#   <frame>          joints 2, 1.0 kg, (+100,   +0, +200)     joints 1, 0.6 kg, no tool
#   <include>        joints 2, 1.0 kg, (+100,   +0, +200)     joints 1, 0.6 kg, no tool
#   eulerseq="XYZ"   joints 2, 1.0 kg, (  +0,   +0, +100)     joints 2, 1.0 kg, (  +0, +100, +200)
#   axis of length 2 joints 2, 1.0 kg, (  +0, +100, +200)     joints 2, 1.0 kg, (  +0, +800, +200)
#   geom only drawn  joints 2, 1.0 kg, (+100,   +0, +200)     joints 2, 9.0 kg, (+100,   +0, +200)
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet pin==4.1.0 mujoco==4.0.0 numpy==2.4.6

venv/bin/python - <<'PYTHON'
from pathlib import Path

import mujoco
import numpy as np
import pinocchio

TOOL = '<body name="tool" pos="0.1 0 0"><joint axis="0 1 0"/><geom size="0.02" mass="0.4"/></body>'
Path("tool.xml").write_text(f"<mujocoinclude>{TOOL}</mujocoinclude>")


def arm(compiler="", turned="", inside=TOOL):
    return f"""
<mujoco>
  <compiler angle="radian" {compiler}/>
  <worldbody>
    <body name="arm" pos="0 0 0.2" {turned}>
      <joint axis="0 0 1"/>
      <geom size="0.03" mass="0.6"/>
      {inside}
    </body>
  </worldbody>
</mujoco>"""


WAYS = {
    "plain": arm(),
    "<frame>": arm(inside=f'<frame pos="0 0 0">{TOOL}</frame>'),
    "<include>": arm(inside='<include file="tool.xml"/>'),
    'eulerseq="XYZ"': arm('eulerseq="XYZ"', 'euler="0 1.5708 1.5708"'),
    "axis of length 2": arm(turned='axisangle="0 0 2 1.5708"'),
    "geom only drawn": arm('inertiagrouprange="0 1"', inside=f'<geom size="0.05" mass="8" group="2"/>{TOOL}'),
}


def by_mujoco(file):
    """Number of joints, mass in kg and place of the tool in m."""
    model = mujoco.MjModel.from_xml_path(file)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return model.nv, float(model.body_mass.sum()), data.body("tool").xpos.copy()


def by_pinocchio(file):
    model = pinocchio.buildModelFromMJCF(file)
    data = model.createData()
    pinocchio.framesForwardKinematics(model, data, pinocchio.neutral(model))
    place = data.oMf[model.getFrameId("tool")].translation if model.existFrame("tool") else None
    return model.nv, pinocchio.computeTotalMass(model), place


def told(seen):
    joints, mass_kg, place = seen
    where = "no tool" if place is None else "({:+4.0f}, {:+4.0f}, {:+4.0f})".format(*(place * 1e3).round() + 0.0)
    return f"joints {joints}, {mass_kg:.1f} kg, {where:20s}"


def agree(one, other):
    return one[:1] == other[:1] and np.isclose(one[1], other[1]) and np.allclose(one[2], other[2], atol=1e-5)


print(f"{'':17s}{'MuJoCo':40s}Pinocchio")
kept = []
for way, text in WAYS.items():
    Path("arm.xml").write_text(text)
    seen = by_mujoco("arm.xml"), by_pinocchio("arm.xml")
    print(f"{way:17s}{told(seen[0])}   {told(seen[1])}".rstrip())
    if agree(*seen):
        kept.append(way)

if kept != ["plain"]:
    raise SystemExit(f"changed: both read the same with {', '.join(kept) or 'none, not even the plain model'}")
PYTHON
