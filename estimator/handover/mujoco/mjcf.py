"""The phantom in MuJoCo's own language: a flex whose vertices sit on the world, on the gripper, or each on a body.

Anchored vertices belong to the world and stand still exactly. Gripped vertices belong to one body, the gripper, which a
weld pulls after a mocap body. Every other vertex has a body of its own with three slides.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from estimator.handover.model import HandedOver
from estimator.handover.mujoco.tetrahedra import linear_tetrahedra

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

GRIPPER, HAND = "gripper", "hand"
# Rayleigh's coefficient as a share of the time step: it takes the ringing off the quickest waves and changes nothing at
# rest. Much more, and explicit steps are unstable; slides of a flex's vertices may have no damping of their own.
_DAMPING_BY_STEP = 0.2
# Share of the time that a wave takes through the thinnest tetrahedron: explicit steps stay stable.
_COURANT = 0.3
_GRIPPER_KG = 0.5


def mjcf_of(handed: HandedOver) -> str:
    """Return the model as MJCF; SI units, no gravity, the gripper at rest."""
    mesh, problem = handed.problem.body.mesh, handed.problem
    tetrahedra = linear_tetrahedra(mesh)
    material = handed.material
    density = handed.runs[0].experiment.phantom.density
    volume, height = sizes(mesh.points, tetrahedra)
    root = ET.Element("mujoco", model="phantom")
    step = _COURANT * float(height.min()) / wave_speed(material.lame, density)
    ET.SubElement(root, "option", timestep=f"{step:.3g}", gravity="0 0 0", integrator="Euler")
    world = ET.SubElement(root, "worldbody")
    centre = _numbers(problem.grasp_centre)
    ET.SubElement(world, "body", name=HAND, mocap="true", pos=centre)
    gripper = ET.SubElement(world, "body", name=GRIPPER, pos=centre)
    ET.SubElement(gripper, "freejoint")
    inertia = _numbers([1e-3 * _GRIPPER_KG] * 3)
    ET.SubElement(gripper, "inertial", pos="0 0 0", mass=f"{_GRIPPER_KG:g}", diaginertia=inertia)
    masses = lumped_masses(len(mesh.points), tetrahedra, density * volume)
    bodies, vertices = [], []
    for node, point in enumerate(mesh.points):
        if problem.fixed[node]:
            bodies.append("world")
            vertices.append(point)
        elif problem.gripped[node]:
            bodies.append(GRIPPER)
            vertices.append(point - problem.grasp_centre)
        else:
            bodies.append(_vertex(world, node, point, masses[node]))
            vertices.append(np.zeros(3))
    deformable = ET.SubElement(root, "deformable")
    flex = ET.SubElement(
        deformable,
        "flex",
        name="tissue",
        dim="3",
        radius="1e-5",
        body=" ".join(bodies),
        vertex=_numbers(np.ravel(vertices)),
        element=" ".join(map(str, tetrahedra.ravel())),
    )
    ET.SubElement(
        flex,
        "elasticity",
        young=f"{material.youngs_modulus:.9g}",
        poisson=f"{material.poisson_ratio:.9g}",
        damping=f"{_DAMPING_BY_STEP * step:.3g}",
    )
    ET.SubElement(flex, "contact", selfcollide="none", contype="0", conaffinity="0")
    equality = ET.SubElement(root, "equality")
    ET.SubElement(equality, "weld", body1=HAND, body2=GRIPPER, solref=f"{2.5 * step:.3g} 1")
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def wave_speed(lame: tuple[float, float], density: float) -> float:
    """Return the speed of a pressure wave, m/s."""
    mu, lam = lame
    return float(np.sqrt((lam + 2 * mu) / density))


def lumped_masses(count: int, tetrahedra: IntArray, masses: FloatArray) -> FloatArray:
    """Return the mass (n,) of each of so many vertices, kg, from that of tetrahedra (t,)."""
    found = np.zeros(count)
    np.add.at(found, tetrahedra, masses[:, None] / 4)
    return found


def vertex_name(node: int) -> str:
    """Return the name of the body of a free vertex."""
    return f"v{node}"


def _vertex(world: ET.Element, node: int, point: FloatArray, mass: float) -> str:
    name = vertex_name(node)
    body = ET.SubElement(world, "body", name=name, pos=_numbers(point))
    for axis in ("1 0 0", "0 1 0", "0 0 1"):
        ET.SubElement(body, "joint", type="slide", axis=axis)
    # The body does not turn: its inertia says nothing, and must not be zero.
    inertia = _numbers([1e-6 * mass] * 3)
    ET.SubElement(body, "inertial", pos="0 0 0", mass=f"{mass:.6g}", diaginertia=inertia)
    return name


def sizes(points: FloatArray, tetrahedra: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return volume (t,), m³, and least height (t,), m, of tetrahedra."""
    corners = points[tetrahedra]
    edges = corners[:, 1:] - corners[:, :1]
    volume = np.abs(np.linalg.det(edges)) / 6
    faces = [(0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)]
    areas = [
        np.linalg.norm(np.cross(corners[:, b] - corners[:, a], corners[:, c] - corners[:, a]), axis=1) / 2
        for a, b, c in faces
    ]
    return volume, 3 * volume / np.max(areas, axis=0)


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{value:.9g}" for value in values)
