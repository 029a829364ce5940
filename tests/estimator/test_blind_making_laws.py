"""The maker's further laws: tractions and grips whose tangents are derivatives, and bodies that are no block."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from blind_scenes import COARSE
from numpy.typing import NDArray

from estimator.blind.making.mechanics.grip import Grip, Jumping
from estimator.blind.making.mechanics.jaws import CreepingSprings, Flexure, Groove
from estimator.blind.making.mechanics.laws import Law
from estimator.blind.making.mechanics.layers import Creeping, Film, Foam, Peeling, Rubbing, Springs
from estimator.blind.making.mechanics.response import Instant
from estimator.blind.making.mechanics.surfaces import Traction
from estimator.blind.making.scenes.outline import Cylinder, Organ, Outline, Uneven, surface_of
from estimator.blind.making.scenes.scene import GRASP_X, GRASP_Y, Mechanics
from estimator.blind.making.scenes.simulate import held_body
from estimator.surfaces.repair import closed_surface

FloatArray = NDArray[np.float64]

NOW = Instant(2.0, 0.5, 1, 0.01)
POINTS = np.random.default_rng(1).uniform(-0.04, 0.04, (12, 3))
TRACTIONS: dict[str, Traction] = {
    "springs": Springs(0, 2e6, 1e6),
    "stiffening": Springs(0, 2e6, 2e6, stiffens_at=1e-3),
    "slack": Springs(0, 2e6, 2e6, slack=4e-4),
    "creeping": Creeping(2e6, 2.0, 5.0),
    "peeling": Peeling(2e6, lambda points, instant: points[:, 1] > 0.01),
    "film": Film(2e4),
    "static_and_kinetic": Rubbing(100.0, sticks=2.0),
    "adhesion_that_breaks": Rubbing(100.0, elastic_slip=1e-3, breaks=True),
    "foam": Foam(5e4),
}
OBLIQUE = np.diag([2e3, 3e3, 4e3, 5.0, 6.0, 7.0])
GRIPS: dict[str, Grip] = {
    "groove": Groove(0, 0.5, 50.0),
    "film": Groove(0, 0.0, 0.0, 400.0),
    "power_law_film": Groove(1, 0.0, 0.0, 40.0, 2.5),
    "turning": Groove(3, 1e-3, 1e-2),
    "stick_slip": Jumping(0.5, 1e-3, most=np.inf),
    "flexure": Flexure(OBLIQUE),
    "stiffening": Flexure(OBLIQUE, stiffens_at=1e-3),
    "play": Flexure(OBLIQUE, play=5e-4),
    "creeping": CreepingSprings(2e3, 5.0, 2.0, 4.0),
}


@pytest.mark.parametrize("law", TRACTIONS.values(), ids=TRACTIONS.keys())
def test_a_tangent_is_the_derivative_of_the_traction(law: Traction) -> None:
    u = np.random.default_rng(2).uniform(-8e-4, 8e-4, POINTS.shape)
    memory = law(POINTS, 0.3 * u, law.start(len(u)), NOW)[2]
    _, tangent, _ = law(POINTS, u, memory, NOW)
    np.testing.assert_allclose(
        tangent, derivative(lambda v: law(POINTS, v, memory, NOW)[0], u), atol=2e-4 * np.abs(tangent).max()
    )


def derivative(traction: Callable[[FloatArray], FloatArray], u: FloatArray, step: float = 1e-8) -> FloatArray:
    """Central differences (n, 3, 3) of a traction of each point's own displacement."""
    found = np.zeros((*u.shape, 3))
    for axis in range(3):
        change = step * np.eye(3)[axis]
        found[:, :, axis] = (traction(u + change) - traction(u - change)) / (2 * step)
    return found


@pytest.mark.parametrize("grip", GRIPS.values(), ids=GRIPS.keys())
def test_a_grips_tangent_is_the_derivative_of_its_wrench(grip: Grip) -> None:
    offset = np.array([2e-3, 1.5e-3, -1e-3, 0.02, -0.01, 0.015])
    memory = grip(0.2 * offset, grip.start(), 0.5)[2]
    _, tangent, _ = grip(offset, memory, 0.5)
    step = np.array([1e-9] * 3 + [1e-8] * 3)
    columns = [
        (grip(offset + change, memory, 0.5)[0] - grip(offset - change, memory, 0.5)[0]) / (2 * one)
        for one, change in zip(step, np.diag(step), strict=True)
    ]
    found = np.column_stack(columns)
    scale = np.sqrt(np.outer(np.diag(grip.holding()), np.diag(grip.holding())))
    np.testing.assert_allclose(tangent / scale, found / scale, atol=2e-3)


def test_what_has_come_off_stays_off() -> None:
    law = Peeling(2e6, lambda points, instant: points[:, 1] > 0.04 - instant.travel)
    u = np.full(POINTS.shape, 1e-5)
    far = law(POINTS, u, law.start(len(u)), replace(NOW, travel=0.05))[2]
    back, _, _ = law(POINTS, u, far, replace(NOW, travel=0.0))
    off = POINTS[:, 1] > -0.01
    assert np.abs(back[off]).max() < 1e-3 * np.abs(back[~off]).min()


OUTLINES: dict[str, tuple[Outline, float]] = {
    "cylinder": (Cylinder(0.02), np.pi * 0.02**2 * 0.1),
    "wedge": (Uneven(lambda x, y: 1 + 4 * x), 1e-4),
}


@pytest.mark.parametrize(("outline", "volume"), OUTLINES.values(), ids=OUTLINES.keys())
def test_a_mesh_fills_its_outline(outline: Outline, volume: float) -> None:
    volumes = held_body(_holding(outline), COARSE).body.quadrature.volumes
    assert volumes.min() > 0
    assert volumes.sum() == pytest.approx(volume, rel=0.02)


@pytest.mark.parametrize("outline", [Cylinder(0.017), Organ(0.008, 0.002, 0.5)], ids=["cylinder", "organ"])
def test_the_surface_that_is_stated_is_closed_and_is_that_of_the_mesh(outline: Outline) -> None:
    surface = closed_surface(*surface_of(outline), "phantom")
    stated = float(np.einsum("ti,ti->", surface.corners.mean(axis=1), surface.area_vectors)) / 3
    volumes = held_body(_holding(outline), COARSE).body.quadrature.volumes
    assert volumes.min() > 0
    assert volumes.sum() == pytest.approx(stated, rel=0.02)


@pytest.mark.parametrize("outline", [Cylinder(0.017), Organ(0.008, 0.002, 0.5)], ids=["cylinder", "organ"])
def test_beads_lie_on_the_upper_face(outline: Outline) -> None:
    above = outline.shaped(np.array([[-0.02, -0.01, 0.005], [0.0, 0.0, 0.005], [0.03, 0.02, 0.005]]))
    np.testing.assert_allclose(outline.top(above[:, 0], above[:, 1]), above[:, 2], atol=1e-9)


def _holding(outline: Outline) -> Mechanics:
    grasp_y = (-0.05, 0.05) if isinstance(outline, Cylinder) else GRASP_Y
    return Mechanics(Law(15e3, 0.45), outline=outline, grasp_x=GRASP_X, grasp_y=grasp_y)
