"""A deformed body by a total Lagrangian formulation: strains, internal forces and tangents of all cells at once."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from estimator.blind.making.mechanics.brick_mesh import BrickMesh, Quadrature

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# Voigt's order; a strain's last three entries are doubled, a stress's are not.
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))


@dataclass(frozen=True)
class Strain:
    """The deformation at every quadrature point.

    Attributes
    ----------
    F : (e, q, 3, 3) deformation gradient
    C : (e·q, 6) right Cauchy-Green tensor in Voigt's order, nothing doubled
    """

    F: FloatArray
    C: FloatArray


@dataclass(frozen=True)
class Body:
    """A mesh with its quadrature, and where its cells' degrees of freedom are."""

    mesh: BrickMesh

    @cached_property
    def quadrature(self) -> Quadrature:
        """Integration over the cells."""
        return self.mesh.quadrature()

    @cached_property
    def unseen_gradients(self) -> FloatArray:
        """What the reduced quadrature does not see, (e, 20, 20) m, as the mesh says."""
        return self.mesh.unseen_gradients()

    @cached_property
    def dofs(self) -> IntArray:
        """Degrees of freedom, 3·node + axis, of every cell, (e, 60)."""
        cells = self.mesh.cells
        return (3 * cells[:, :, None] + np.arange(3)).reshape(len(cells), -1)

    @property
    def shapes(self) -> FloatArray:
        """Shape functions at a cell's quadrature points, (q, 20)."""
        return self.quadrature.shapes

    @property
    def gauss_points(self) -> FloatArray:
        """Where stress is evaluated, at rest, (e·q, 3) m."""
        return self.quadrature.points.reshape(-1, 3)

    def strain(self, u: FloatArray) -> Strain:
        """Return the deformation under displacements (n, 3) m."""
        F = np.eye(3) + np.matmul(np.swapaxes(u[self.mesh.cells], 1, 2)[:, None], self.quadrature.gradients)
        C = np.matmul(np.swapaxes(F, 2, 3), F).reshape(-1, 3, 3)
        return Strain(F, np.stack([C[:, i, j] for i, j in PAIRS], axis=1))

    def internal_forces(self, strain: Strain, S: FloatArray) -> FloatArray:
        """Return the nodal forces of each cell, (e, 60) N, of stresses S (e·q, 6)."""
        stress = self._tensor(S) * self.quadrature.volumes[..., None, None]
        first_piola = np.matmul(strain.F, stress)
        forces = np.einsum("eqij,eqnj->eni", first_piola, self.quadrature.gradients, optimize=True)
        return forces.reshape(len(forces), -1)

    def stiffness(self, strain: Strain, S: FloatArray, D: FloatArray) -> FloatArray:
        """Return the tangents of each cell, (e, 60, 60) N/m, of S (e·q, 6) and D = dS/dE (e·q, 6, 6)."""
        gradients, volumes = self.quadrature.gradients, self.quadrature.volumes
        e, q, n, _ = gradients.shape
        B = np.empty((e, q, 6, n, 3))
        for row, (a, b) in enumerate(PAIRS):
            B[:, :, row] = strain.F[:, :, None, :, a] * gradients[..., b, None]
            if a != b:
                B[:, :, row] += strain.F[:, :, None, :, b] * gradients[..., a, None]
        rows = B.reshape(e, q, 6, 3 * n)
        weighted = np.matmul(D.reshape(e, q, 6, 6) * volumes[..., None, None], rows)
        K = np.matmul(np.swapaxes(rows.reshape(e, 6 * q, 3 * n), 1, 2), weighted.reshape(e, 6 * q, 3 * n))
        stressed = np.matmul(gradients, self._tensor(S) * volumes[..., None, None])
        flat = np.swapaxes(gradients, 2, 3).reshape(e, 3 * q, n)
        geometric = np.matmul(np.swapaxes(stressed, 2, 3).reshape(e, 3 * q, n).swapaxes(1, 2), flat)
        blocks = K.reshape(e, n, 3, n, 3)
        for i in range(3):
            blocks[:, :, i, :, i] += geometric
        return K

    def _tensor(self, S: FloatArray) -> FloatArray:
        e, q = self.quadrature.volumes.shape
        tensor = np.empty((e, q, 3, 3))
        values = S.reshape(e, q, 6)
        for k, (i, j) in enumerate(PAIRS):
            tensor[:, :, i, j] = tensor[:, :, j, i] = values[..., k]
        return tensor
