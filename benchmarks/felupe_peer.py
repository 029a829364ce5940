"""The peer: FElupe with CHOLMOD, of those measured the fastest, and an estimation in the paper's manner on it."""

import felupe
import numpy as np
from kvxopt import cholmod, matrix, spmatrix
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.sparse import csr_matrix, tril

from benchmarks.pull import POSES
from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.materials.material import Material, make_material
from estimator.materials.neo_hookean import NeoHookean

FloatArray = NDArray[np.float64]

_TOLERANCE = 1e-8


class FelupePull:
    """The Pull on a mesh of linear tetrahedra, solved from rest each time."""

    def __init__(self, problem: RetractionProblem) -> None:
        self._problem = problem
        mesh = felupe.Mesh(problem.body.mesh.points, problem.body.mesh.cells, "tetra")
        self._region = felupe.RegionTetra(mesh)
        held = np.repeat(problem.fixed | problem.gripped, 3)
        self._held, self._free = np.flatnonzero(held), np.flatnonzero(~held)
        self.runs = 0

    def solve(self, material: Material) -> tuple[FloatArray, FloatArray]:
        """Return forces (10, 3) of the tissue on the gripper, N, and fiducials (10, m, 3), m.

        Raises
        ------
        ArithmeticError
            A step did not converge.
        """
        self.runs += 1
        problem, (mu, lame) = self._problem, material.lame
        points = problem.body.mesh.points
        field = felupe.FieldContainer([felupe.Field(self._region, dim=3)])
        body = felupe.SolidBody(felupe.NeoHookeCompressible(mu=mu) & felupe.Volumetric(bulk=lame), field)
        forces, fiducials = [], []
        for pose in POSES[1:]:
            prescribed = np.zeros_like(points)
            prescribed[problem.gripped] = problem.gripped_positions(pose) - points[problem.gripped]
            result = felupe.newtonraphson(
                x0=field,
                items=[body],
                dof0=self._held,
                dof1=self._free,
                ext0=prescribed.reshape(-1)[self._held],
                tol=_TOLERANCE,
                solver=_by_cholmod,
                verbose=False,
            )
            if not result.success:
                raise ArithmeticError("FElupe's Newton iteration did not converge")
            nodal = body.assemble.vector().toarray().reshape(-1, 3)
            forces.append(-nodal[problem.gripped].sum(axis=0))
            fiducials.append(problem.fiducial_positions(field[0].values, pose))
        return np.array(forces), np.array(fiducials)


def estimate_by_slsqp(pull: FelupePull, experiment: Experiment) -> tuple[float, float]:
    """Return E, Pa, and ν by the paper's objective, prescaled, with SLSQP and finite differences, as the paper does."""
    measured, seen = experiment.wrench[1:, :3], experiment.fiducials[1:]
    motions = np.sum((seen - experiment.fiducials_rest) ** 2)

    def objective(scaled: FloatArray) -> float:
        material = make_material(NeoHookean(), 1e4 * scaled[0], scaled[1])
        force, fiducials = pull.solve(material)
        return float(
            np.sum((fiducials - seen) ** 2) / motions + np.sum((force - measured) ** 2) / np.sum(measured**2)
        )

    found = minimize(
        objective,
        np.array([1.0, 0.4]),
        method="SLSQP",
        bounds=[(0.1, 10.0), (0.0, 0.499)],
        options={"ftol": 1e-10},
    )
    return 1e4 * float(found.x[0]), float(found.x[1])


def _by_cholmod(stiffness: csr_matrix, load: FloatArray) -> FloatArray:
    lower = tril(stiffness).tocoo()
    system = spmatrix(lower.data, lower.row.tolist(), lower.col.tolist(), stiffness.shape)
    solution = matrix(np.asarray(load, dtype=np.float64).reshape(-1, 1))
    cholmod.linsolve(system, solution)
    return np.array(solution).reshape(-1)
