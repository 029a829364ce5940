"""How far the tissue is stretched, for pictures."""

import numpy as np
from numpy.typing import NDArray

from estimator.fem.discretisation.elements import evaluate, reference_element
from estimator.fem.discretisation.mesh import Mesh

FloatArray = NDArray[np.float64]


def largest_stretch(mesh: Mesh, displacement: FloatArray) -> FloatArray:
    """Return the largest principal stretch (n,) at every node, averaged over the elements that share it.

    Parameters
    ----------
    mesh : Mesh
    displacement : (n, 3) float64, m
    """
    _, gradient = evaluate(mesh.kind, reference_element(mesh.kind).nodes)
    rest = np.einsum("ekx,qkr->eqxr", mesh.points[mesh.cells], gradient)
    deformed = np.einsum("ekx,qkr->eqxr", (mesh.points + displacement)[mesh.cells], gradient)
    F = deformed @ np.linalg.inv(rest)
    stretch = np.linalg.norm(F, ord=2, axis=(2, 3))
    nodes, count = mesh.cells.ravel(), len(mesh.points)
    total = np.bincount(nodes, stretch.ravel(), minlength=count)
    return total / np.maximum(np.bincount(nodes, minlength=count), 1)
