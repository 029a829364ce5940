"""How the body deforms through an experiment."""

import numpy as np

from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.result import DeformedMesh


def deformed_mesh(case: Case, fit: Linearisation, number: int) -> DeformedMesh:
    """Return the body through an experiment: at the fit, or, where its mechanics are extrapolated, at its neighbour."""
    of_row = fit.mechanics[number].solution.load_steps.of_row
    _, first = np.unique(of_row, return_index=True)
    displacements = np.array([fit.known[number][row].displacement for row in first])
    return DeformedMesh(case.problem.body.mesh, displacements, of_row)
