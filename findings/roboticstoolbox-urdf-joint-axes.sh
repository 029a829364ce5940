#!/usr/bin/env bash
# roboticstoolbox-python 1.5.0: dynamics of a URDF joint about a negative axis, pose of one about an oblique axis
#
# Expected: an arm read from URDF has the poses and the torques of its file, whatever the joint axes are.
# What happens:
#   - a joint about (0, -1, 0) moves the right way in `fkine` and `jacob0`, but `rne`, `gravload` and `inertia` turn it
#     the other way: the arm has one pose for kinematics and another for dynamics;
#   - a joint about an axis that is none of x, y, z has the link frame turned, so that its z is the axis, and never
#     turned back: all behind it stands elsewhere, also at angle 0.
# Documented: the note of `rne` names robots from URDF among those that it is right for; the axis is "in the joint
# frame", without limits. Nothing warns.
# Why it matters: the torque that is left after gravity compensation is taken for the contact force. Half of the axes
# in the usual descriptions of six-axis KUKA arms are negative.
# Instead: write the file with positive axes and change the sign of those angles, or take another library for dynamics;
# compare `gravload` with the derivative of the potential energy that `fkine` gives.
#
# Two point masses on a planar arm that lies along x at angles 0; axes about +y or -y, angles 0.3 and 0.4 rad.
#
# Seen:
#   axes (+1 y, +1 y): elbow at -0.118 m (by hand -0.118), torques [-13.5   -2.25] N m (by hand [-13.5   -2.25])
#   axes (-1 y, +1 y): elbow at +0.118 m (by hand +0.118), torques [-14.17  -2.93] N m (by hand [14.17 -2.93])
#   axes (+1 y, -1 y): elbow at -0.118 m (by hand -0.118), torques [-14.17  -2.93] N m (by hand [-14.17   2.93])
#   axes (-1 y, -1 y): elbow at +0.118 m (by hand +0.118), torques [-13.5   -2.25] N m (by hand [13.5   2.25])
#   first axis (0.6, 0, 0.8), angles 0: elbow at [0.282 0.269 0.088] m, by hand [0.4 0. 0. ]
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet roboticstoolbox-python==1.5.0 numpy==2.4.6

venv/bin/python - <<'PYTHON'
from pathlib import Path

import numpy as np
from roboticstoolbox import Robot
from roboticstoolbox.models.URDF.URDFRobot import URDF_read

GRAVITY, UPPER_M, LOWER_M, MASSES_KG, ANGLES_RAD = 9.81, 0.4, 0.3, (2.0, 1.0), np.array([0.3, 0.4])
LINK = '<link name="{0}"><inertial><mass value="{1}"/><origin xyz="{2} 0 0"/>' \
    '<inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial></link>'
JOINT = '<joint name="to {1}" type="revolute"><parent link="{0}"/><child link="{1}"/><origin xyz="{2} 0 0"/>' \
    '<axis xyz="{3}"/><limit lower="-3" upper="3" effort="9" velocity="9"/></joint>'


def arm(shoulder_axis, elbow_axis):
    links = LINK.format("upper", MASSES_KG[0], UPPER_M) + LINK.format("lower", MASSES_KG[1], LOWER_M)
    joints = JOINT.format("root", "upper", 0, shoulder_axis) + JOINT.format("upper", "lower", UPPER_M, elbow_axis)
    Path("arm.urdf").write_text(f'<robot name="arm"><link name="root"/>{links}{joints}</robot>')
    return Robot(URDF_read(Path("arm.urdf").resolve())[0])


def by_hand(signs):
    """Torques in N m that hold the arm; a turn about +y lowers what points along x."""
    first, both = signs[0] * ANGLES_RAD[0], np.dot(signs, ANGLES_RAD)
    upper = -GRAVITY * sum(MASSES_KG) * UPPER_M * np.cos(first)
    lower = -GRAVITY * MASSES_KG[1] * LOWER_M * np.cos(both)
    return np.array([signs[0] * (upper + lower), signs[1] * lower])


wrong = []
for signs in ((1, 1), (-1, 1), (1, -1), (-1, -1)):
    robot = arm(*(f"0 {sign} 0" for sign in signs))
    height_m = robot.fkine(ANGLES_RAD, end="lower").t[2]
    true_height_m = -UPPER_M * np.sin(signs[0] * ANGLES_RAD[0])
    torque, true_torque = robot.gravload(ANGLES_RAD), by_hand(signs)
    print(
        f"axes ({signs[0]:+d} y, {signs[1]:+d} y): elbow at {height_m:+.3f} m (by hand {true_height_m:+.3f}), "
        f"torques {torque.round(2)} N m (by hand {true_torque.round(2)})"
    )
    if not np.isclose(height_m, true_height_m):
        raise SystemExit("changed: the kinematics of a negative axis differ too")
    wrong.append(not np.allclose(torque, true_torque))

oblique = arm("0.6 0 0.8", "0 1 0")
place = oblique.fkine([0.0, 0.0], end="lower").t
print(f"first axis (0.6, 0, 0.8), angles 0: elbow at {place.round(3)} m, by hand [{UPPER_M} 0. 0. ]")
if wrong != [False, True, True, True]:
    raise SystemExit("changed: torques about negative axes are right, or those about positive ones are not")
if np.allclose(place, [UPPER_M, 0, 0]):
    raise SystemExit("changed: a joint about an oblique axis is placed rightly")
PYTHON
