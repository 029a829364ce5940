"""An experiment folder as a person would write it, and what can be edited in it."""

import struct
from dataclasses import fields
from pathlib import Path

import numpy as np

from estimator.experiment import Experiment

TOML = """\
format = "retraction-experiment/1"
name = "first pull"
phantom_id = "P07"
order = 2
unknown_key = "is ignored"

[phantom]
shape = "block"
size = [0.10, 0.10, 0.01]
density = 1080.0

[[anchor]]
box = [[-0.0499, 0.0501, 0.0051], [-0.0501, -0.0501, -0.0051]]

[[anchor]]
box = [[-0.0501, 0.0499, -0.0051], [0.0501, 0.0501, 0.0051]]

[grasp]
box = [[0.03, -0.01, -0.0051], [0.05, 0.01, 0.0051]]
centre = [0.04, 0.0, 0.0]

[trajectory]
kind = "pull"

[environment]
gravity = [0.0, 0.0, -9.81]
surface_below = "none"

[sensor]
force_std = 0.02
torque_std = 0.0005
fiducial_std = 5.0e-5
position_std = 3.0e-5
tool_mass = 0.35
tool_centre = [0.0, 0.0, 0.06]

[fiducials]
rest = [[-0.03, -0.03, 0.005], [-0.01, -0.03, 0.005]]
"""

CSV = """\
time,phase,step,px,py,pz,qw,qx,qy,qz,fx,fy,fz,tx,ty,tz,m00x,m00y,m00z,m01x,m01y,m01z
0.0,hold,0,0.04,0,0,1,0,0,0,0.01,0,0,0,0,0,-0.03,-0.03,0.005,-0.01,-0.03,0.005
0.5,ramp,1,0.044,0,0,1,0,0,0,-0.5,,,0,0,0,-0.0298,-0.03,0.005,,,
1.0,hold,1,0.048,0,0,1,0,0,0,-0.9,0,0,0,0,0,-0.0296,-0.03,0.005,-0.009,-0.03,0.005
1.5,ramp,2,0.052,0,0,1,0,0,0,-1.4,0,0,0,0,0,-0.0294,-0.03,0.005,-0.008,-0.03,0.005
2.0,hold,2,0.056,0,0,1,0,0,0,-1.9,0,0,0,0,0,-0.0292,-0.03,0.005,-0.007,-0.03,0.005
2.5,return,3,0.06,0,0,0.99984770,0.01745241,0,0,-2.3,0,0,0,0,0,-0.029,-0.03,0.005,-0.006,-0.03,0.005
3.0,return_hold,3,0.062,0,0,1,0,0,0,-2.5,0,0,0,0,0,-0.0288,-0.03,0.005,-0.005,-0.03,0.005
"""


def written_by_hand(folder: Path) -> Path:
    folder.mkdir(parents=True)
    (folder / "experiment.toml").write_text(TOML)
    (folder / "observations.csv").write_text(CSV)
    return folder


def edit(file: Path, old: str, new: str) -> None:
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


def write_cube_stl(file: Path, half_edge: float) -> None:
    """A binary STL of a cube about the origin."""
    corners = half_edge * np.array(np.meshgrid(*[[-1.0, 1.0]] * 3, indexing="ij")).reshape(3, -1).T
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *corners[list(t)].ravel(), 0) for t in triangles)
    file.write_bytes(bytes(80) + struct.pack("<I", len(triangles)) + body)


def as_surface(folder: Path) -> None:
    edit(folder / "experiment.toml", 'shape = "block"', 'shape = "surface"\nsurface = "phantom.stl"')


def assert_equal(a: Experiment, b: Experiment) -> None:
    for field in fields(Experiment):
        if field.name == "path":
            continue
        one, other = getattr(a, field.name), getattr(b, field.name)
        if isinstance(one, np.ndarray):
            np.testing.assert_array_equal(one, other, err_msg=field.name)
        else:
            assert one == other, field.name
