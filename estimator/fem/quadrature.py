"""Where the integration points of a mesh lie."""

import numpy as np
from numpy.typing import NDArray

from estimator.fem.elements import reference_element
from estimator.fem.mesh import Mesh

FloatArray = NDArray[np.float64]


def quadrature_points(mesh: Mesh) -> FloatArray:
    """Return the positions (e, q, 3) of the integration points at rest, tissue frame, m."""
    shape = reference_element(mesh.kind).shape
    return np.einsum("qk,ekx->eqx", shape, mesh.points[mesh.cells], optimize=True)
