"""The maker's equilibrium by an independent package, on every kind of body: FElupe's own assembly, law and Newton."""

import felupe
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.blind.making.mechanics.equilibrium import Solver
from estimator.blind.making.mechanics.holding import HeldBody, Pose
from estimator.blind.making.mechanics.laws import Law
from estimator.blind.making.mechanics.response import Instant
from estimator.blind.making.scenes.outline import Cylinder, Organ
from estimator.blind.making.scenes.retraction import GRIPPER_AT_REST
from estimator.blind.making.scenes.scene import Mechanics
from estimator.blind.making.scenes.simulate import PILOT, held_body

FloatArray = NDArray[np.float64]

LAW = Law(15e3, 0.42)
BODIES = {
    "block": Mechanics(LAW),
    "block held on two faces": Mechanics(LAW, two_sides=True),
    "organ": Mechanics(LAW, outline=Organ(0.008, 0.002, 0.5)),
    "cylinder": Mechanics(LAW, outline=Cylinder(0.018), grasp_y=(-0.05, 0.05)),
}
# 10 mm along +x while turning by 14° about an oblique axis, in two steps.
POSES = [
    Pose(
        GRIPPER_AT_REST + np.array([0.005 * n, 0.0, 0.0]),
        Rotation.from_rotvec(n * np.array([0.08, 0.0, 0.09])),
    )
    for n in (1, 2)
]


def by_felupe(held: HeldBody) -> tuple[FloatArray, FloatArray]:
    """Displacements (n, 3) and nodal forces (n, 3) at the last pose, by full quadrature."""
    mesh = felupe.Mesh(held.body.mesh.points, held.body.mesh.cells, "hexahedron20")
    region = felupe.RegionQuadraticHexahedron(mesh)
    field = felupe.FieldContainer([felupe.Field(region, dim=3)])
    mu = LAW.youngs_modulus / (2 * (1 + LAW.poisson_ratio))
    lame = 2 * mu * LAW.poisson_ratio / (1 - 2 * LAW.poisson_ratio)
    body = felupe.SolidBody(felupe.NeoHookeCompressible(mu=mu) & felupe.Volumetric(bulk=lame), field)
    fixed = np.repeat(held.fixed | held.gripped, 3)
    for pose in POSES:
        prescribed = np.zeros((len(held.gripped), 3))
        prescribed[held.gripped] = held.held_displacements(pose, np.zeros(6))
        result = felupe.newtonraphson(
            x0=field,
            items=[body],
            dof0=np.flatnonzero(fixed),
            dof1=np.flatnonzero(~fixed),
            ext0=prescribed.reshape(-1)[fixed],
            tol=1e-10,
            verbose=False,
        )
        assert result.success
    return field[0].values, body.assemble.vector().toarray().reshape(-1, 3)


@pytest.mark.parametrize("mechanics", BODIES.values(), ids=BODIES.keys())
def test_another_package_finds_the_same_equilibrium(mechanics: Mechanics) -> None:
    held = held_body(mechanics, PILOT)
    solver = Solver(held)
    state = solver.rest()
    for pose in POSES:
        state = solver.advance(state, pose, Instant(0.0, 0.0, 1, 0.01))
    u, forces = by_felupe(held)
    wrench = held.wrench(POSES[-1], u, forces[held.gripped].reshape(-1))
    scale = np.repeat([np.linalg.norm(wrench[:3]), np.linalg.norm(wrench[3:])], 3)
    # FElupe integrates these elements in full, which is stiffer than the maker's reduced rule with hourglass control.
    assert np.abs((state.wrench - wrench) / scale).max() < 0.02
    assert np.sqrt(np.mean((state.u - u) ** 2)) < 5e-5
