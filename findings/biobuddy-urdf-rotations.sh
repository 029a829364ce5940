#!/usr/bin/env bash
# biobuddy 0.3.2: another URDF than the one that was read
#
# Expected: `from_urdf` places the links as URDF defines (roll, pitch and yaw about the axes of the parent, which do
# not move: R = Rz(yaw) Ry(pitch) Rx(roll)), keeps the sense of a joint, and `to_biomod` keeps the inertias.
# What happens:
#   - the three angles are taken about axes that move along, R = Rx Ry Rz, so a link with two angles or more stands
#     elsewhere. `to_urdf` makes the same mistake backwards, so reading and writing again hides it, and a model that
#     comes from OpenSim or bioMod is wrong in its URDF;
#   - a joint about (0, 0, -1) becomes one about (0, 0, 1), with its range mirrored, under the same name: its recorded
#     angles now turn it the other way, also in the URDF that is written;
#   - bioMod has six digits after the point, so in kg m^2 the inertia of a tool of 20 g is a matrix of zeros.
# Why it matters: arms of seven joints have such links ("1.5708 0 3.1416" is common), and joint angles are recorded by
# name. An oblique axis is refused; these are not.
# Instead: read URDF with a library for robots, and hand frames over as matrices (bioMod takes them).
#
# Two joints, read with biobuddy, written by it, and both files read with yourdfpy; angles in rad, places in mm.
#
# Seen:
#   arm.urdf, yourdfpy                     tool at (-50, +200, +200) mm, turned by   0 deg
#   arm.urdf, biobuddy                     tool at (-50, -200, +0) mm, turned by 180 deg
#   written by biobuddy, read by yourdfpy  tool at (-50, +200, +200) mm, turned by  57 deg
#   <axis xyz="0 0 1"/> <axis xyz="0 0 1"/>
#   inertia in the bioMod file, given 4e-7, 4e-7, 1e-7 kg m^2: 0.0 0.0 0.0
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet biobuddy==0.3.2 ezc3d==1.7.2 matplotlib==3.11.2 pandas==3.1.1 \
    yourdfpy==0.0.60 numpy==2.4.6 scipy==1.17.1

cat > arm.urdf <<'URDF'
<?xml version="1.0"?>
<robot name="arm">
  <link name="root"/>
  <link name="upper"/>
  <link name="tool">
    <inertial>
      <mass value="0.02"/>
      <origin xyz="0 0 0.01" rpy="0 0 0"/>
      <inertia ixx="4e-7" iyy="4e-7" izz="1e-7" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <joint name="shoulder" type="revolute">
    <parent link="root"/>
    <child link="upper"/>
    <origin xyz="0 0 0.1" rpy="1.570796 0 3.141593"/>
    <axis xyz="0 0 1"/>
    <limit lower="-1" upper="2" effort="1" velocity="1"/>
  </joint>
  <joint name="wrist" type="revolute">
    <parent link="upper"/>
    <child link="tool"/>
    <origin xyz="0.05 0.1 0.2" rpy="0 0 0"/>
    <axis xyz="0 0 -1"/>
    <limit lower="-1" upper="2" effort="1" velocity="1"/>
  </joint>
</robot>
URDF

venv/bin/python - <<'PYTHON'
import numpy as np
import yourdfpy
from biobuddy import BiomechanicalModelReal
from scipy.spatial.transform import Rotation

JOINT_RAD = {"shoulder": 0.0, "wrist": 0.5}
SHOULDER_RPY = (1.570796, 0.0, 3.141593)


def by_yourdfpy(file):
    """Pose of the tool in the root frame."""
    arm = yourdfpy.URDF.load(file, load_meshes=False, build_scene_graph=True)
    arm.update_cfg(JOINT_RAD)
    return arm.get_transform("tool", "root")


def by_biobuddy(model):
    angles = np.array([[JOINT_RAD[name]] for name in model.dof_names])
    pose = model.forward_kinematics(angles)["tool"][0]
    return np.array(pose.rt_matrix)


def told(name, pose):
    place = ", ".join(f"{value:+.0f}" for value in pose[:3, 3] * 1e3 + 0.0)
    turned = np.degrees(np.linalg.norm(Rotation.from_matrix(true[:3, :3].T @ pose[:3, :3]).as_rotvec()))
    print(f"{name:38s} tool at ({place}) mm, turned by {turned:3.0f} deg")


model = BiomechanicalModelReal().from_urdf("arm.urdf")
model.to_urdf("again.urdf")
model.to_biomod("arm.bioMod")
by_definition = Rotation.from_euler("xyz", SHOULDER_RPY).as_matrix()
shoulder = np.array(model.segments["upper"].segment_coordinate_system.scs.rt_matrix)[:3, :3]
true, got, again = by_yourdfpy("arm.urdf"), by_biobuddy(model), by_yourdfpy("again.urdf")
told("arm.urdf, yourdfpy", true)
told("arm.urdf, biobuddy", got)
told("written by biobuddy, read by yourdfpy", again)
with open("again.urdf") as file:
    print(*(line.strip() for line in file if "<axis" in line))
with open("arm.bioMod") as file:
    lines = [line.split() for line in file]
at = lines.index(["inertia"])
inertia = np.array(lines[at + 1 : at + 4], float)
print("inertia in the bioMod file, given 4e-7, 4e-7, 1e-7 kg m^2:", *np.diag(inertia))

if np.allclose(shoulder, by_definition, atol=1e-5):
    raise SystemExit("changed: roll, pitch and yaw are taken as URDF defines them")
if not np.allclose(shoulder, Rotation.from_euler("XYZ", SHOULDER_RPY).as_matrix(), atol=1e-5):
    raise SystemExit("changed: roll, pitch and yaw are taken in a third way")
if np.allclose(again, true, atol=1e-5) or inertia.any():
    raise SystemExit("changed: the sense of the joint or the small inertia is kept")
PYTHON
