"""A meshed body ready for integration, and the energy of a law on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.errors import SolverError
from estimator.fem.assembly.kernels import (
    ProjectedDilatation,
    deformation_gradient,
    dilatation_rate,
    element_forces,
    element_stiffness,
    invariants,
)
from estimator.fem.assembly.stress_kernels import element_forces_of_stress, first_piola, second_piola
from estimator.fem.discretisation.elements import reference_element
from estimator.fem.discretisation.mesh import Mesh
from estimator.materials.law import EnergyDerivatives
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Body:
    """A mesh with its integration data.

    Attributes
    ----------
    mesh : Mesh
    gradient : (e, q, k, 3) float64, derivatives of the shape functions by the rest position, 1/m
    volume : (e, q) float64, quadrature weight times reference volume times ``modulus``, m³
    basis : (e, q, r) float64, functions of the projected dilatation, orthonormal in each element, m^−3/2
    modulus : (e, q) float64, how many times as stiff as its material says the tissue is
    """

    mesh: Mesh
    gradient: FloatArray
    volume: FloatArray
    basis: FloatArray
    modulus: FloatArray

    @property
    def rest_volume(self) -> FloatArray:
        """The volume (e, q) that an integration point stands for at rest, however stiff it is, m³."""
        return self.volume / self.modulus


@dataclass(frozen=True)
class Response:
    """What the material answers to a displacement field.

    Attributes
    ----------
    F : (e, q, 3, 3) deformation gradient
    energy : strain energy, J
    slope : (3, e, q) derivatives of the energy density by I1, I2, J
    dilatation : (e, q) projected dilatation: of J − 1, or of what the law has in its place
    pressure : (e, q) λ times that, Pa; a part of ``slope``
    law : the law's own derivatives at the e·q points
    """

    F: FloatArray
    energy: float
    slope: FloatArray
    dilatation: FloatArray
    pressure: FloatArray
    law: EnergyDerivatives


@dataclass(frozen=True)
class AddedEnergy:
    """What adds to the derivatives of the energy density, for a tangent of all at once.

    Attributes
    ----------
    slope : (3, e, q) Pa, first derivatives by I1, I2 and J
    curvature : (6, e, q) Pa, second derivatives by I1I1, I1I2, I1J, I2I2, I2J, JJ
    bulk : (e,) Pa, by what λ of the projected dilatation is larger, or one for all
    """

    slope: FloatArray
    curvature: FloatArray
    bulk: FloatArray | float = 0.0

    def __add__(self, other: AddedEnergy) -> AddedEnergy:
        """Return what both add together."""
        return AddedEnergy(self.slope + other.slope, self.curvature + other.curvature, self.bulk + other.bulk)


def build_body(mesh: Mesh, modulus: FloatArray | None = None) -> Body:
    """Precompute the integration data of a mesh.

    Parameters
    ----------
    mesh : Mesh
    modulus : (e, q) how many times as stiff as its material says the tissue is; 1 everywhere where None

    Raises
    ------
    SolverError
        An element has a non-positive volume.
    """
    element = reference_element(mesh.kind)
    corners = mesh.points[mesh.cells]
    jacobian = np.einsum("ekx,qkr->eqxr", corners, element.gradient, optimize=True)
    determinant = np.linalg.det(jacobian)
    if determinant.min() <= 0.0:
        bad = int(np.argmin(determinant.min(axis=1)))
        raise SolverError(f"element {bad} of the mesh has a negative volume; reorder its nodes or mesh again")
    gradient = np.einsum("qkr,eqrx->eqkx", element.gradient, np.linalg.inv(jacobian), optimize=True)
    # In one layout always: the loops are compiled for each.
    factor = np.ones_like(determinant) if modulus is None else modulus
    volume = np.ascontiguousarray(determinant * element.weights * factor)
    basis = _orthonormal(element.dilatation_basis, volume)
    return Body(mesh, np.ascontiguousarray(gradient), volume, basis, factor)


def respond(body: Body, material: Material, displacement: FloatArray) -> Response:
    """Evaluate a material at nodal displacements (n, 3).

    Raises
    ------
    SolverError
        The displacement turns an element inside out, or leaves the domain of the law.
    """
    F = deformation_gradient(displacement, body.mesh.cells, body.gradient)
    i1, i2, j = invariants(F)
    if not j.min() > 0.0:
        raise SolverError("an element is turned inside out")
    law = material.law.derivatives(i1.ravel(), i2.ravel(), j.ravel(), material.shape)
    by = law.dilatation_by
    dilatation = _projected(body, by[0] * (i1 - 3.0) + by[1] * (i2 - 3.0) + by[2] * (j - 1.0))
    return _answer(body, material, F, dilatation, law)


def respond_alike(body: Body, material: Material, response: Response) -> Response:
    """Evaluate another material of the same law and shape at the deformation of a response."""
    return _answer(body, material, response.F, response.dilatation, response.law)


def _answer(
    body: Body, material: Material, F: FloatArray, dilatation: FloatArray, law: EnergyDerivatives
) -> Response:
    mu, lame = material.lame
    slope = mu * law.first.reshape(3, *dilatation.shape)
    slope = slope + np.multiply.outer(law.dilatation_by, lame * dilatation)
    energy = mu * float(np.sum(body.volume.ravel() * law.value))
    energy += 0.5 * lame * float(np.sum(body.volume * dilatation**2))
    return Response(F, energy, slope, dilatation, lame * dilatation, law)


def nodal_forces(body: Body, response: Response, slope: FloatArray) -> FloatArray:
    """Return the nodal forces (n, 3), N, of energy slopes (3, e, q) at the deformation of ``response``."""
    return _summed_at_nodes(body, element_forces(response.F, body.gradient, body.volume, slope))


def forces_of_stress(body: Body, stress: FloatArray) -> FloatArray:
    """Return the nodal forces (n, 3), N, of a first Piola–Kirchhoff stress (e, q, 3, 3), Pa."""
    return _summed_at_nodes(body, element_forces_of_stress(stress, body.gradient, body.volume))


def stress_of(F: FloatArray, slope: FloatArray) -> FloatArray:
    """Return the first Piola–Kirchhoff stress (e, q, 3, 3), Pa, of energy slopes (3, e, q) by I1, I2 and J."""
    return first_piola(F, second_piola(F, slope))


def with_modulus(body: Body, factor: FloatArray) -> Body:
    """Return the body with its stiffness multiplied by ``factor`` (e, q) > 0 at every integration point.

    Factors of one body after the other multiply. μ and λ scale together. The dilatation is projected in the norm that
    the stiffness weighs, which keeps the formulation symmetric; the factor may jump within an element.
    """
    volume = body.volume * factor
    functions = reference_element(body.mesh.kind).dilatation_basis
    return Body(body.mesh, body.gradient, volume, _orthonormal(functions, volume), body.modulus * factor)


def slopes_by_parameter(material: Material, response: Response) -> dict[str, FloatArray]:
    """Return the derivative of ``response.slope`` by each parameter of the material, at fixed deformation."""
    shape = response.slope.shape
    by_mu = response.law.first.reshape(shape)
    by_lame = np.multiply.outer(response.law.dilatation_by, response.dilatation)
    slopes = {name: mu * by_mu + lame * by_lame for name, (mu, lame) in material.lame_derivatives.items()}
    mu = material.lame[0]
    for n, parameter in enumerate(material.law.shape_parameters):
        slopes[parameter.name] = mu * response.law.first_by_shape[n].reshape(shape)
    return slopes


def pressure_after(body: Body, material: Material, response: Response, change: FloatArray) -> FloatArray:
    """Return the pressure λ·(projected dilatation), linearised, once the displacements (n, 3) change: (e, q), Pa."""
    by = response.law.dilatation_by
    rate = dilatation_rate(response.F, body.mesh.cells, body.gradient, change, by)
    return material.lame[1] * (response.dilatation + _projected(body, rate))


def stiffness(
    body: Body,
    material: Material,
    response: Response,
    pressure: FloatArray,
    added: AddedEnergy | None = None,
) -> FloatArray:
    """Return the tangent stiffness of each element, (e, 3k, 3k), lower triangle filled.

    Parameters
    ----------
    pressure : (e, q), Pa; at equilibrium λ·(projected dilatation). On the way there it is better taken from
        :func:`pressure_after`: the tangent then is that of the mixed formulation with the pressure as an unknown,
        whose Newton iteration does not suffer from a large λ (Simo & Taylor 1991, section 3).
    added : to the energy of the material; it takes no loop over the elements of its own
    """
    _, lame = material.lame
    count, rule = body.volume.shape
    curvature = material.lame[0] * response.law.second.reshape(6, count, rule)
    by = response.law.dilatation_by
    if not body.basis.shape[2]:
        first, second = np.triu_indices(3)
        curvature += (lame * np.take(by, first) * np.take(by, second))[:, None, None]
    slope = response.slope + np.multiply.outer(by, pressure - response.pressure)
    bulk = np.full(count, lame)
    if added is not None:
        slope, curvature, bulk = slope + added.slope, curvature + added.curvature, bulk + added.bulk
    dilatation = ProjectedDilatation(body.basis, bulk, by)
    return element_stiffness(response.F, body.gradient, body.volume, slope, curvature, dilatation)


def _summed_at_nodes(body: Body, per_element: FloatArray) -> FloatArray:
    """Sum the forces of the elements' nodes (e, k, 3) to nodal forces (n, 3)."""
    nodes, count = body.mesh.cells.ravel(), len(body.mesh.points)
    flat = per_element.reshape(-1, 3)
    return np.stack([np.bincount(nodes, flat[:, i], minlength=count) for i in range(3)], axis=1)


def _projected(body: Body, values: FloatArray) -> FloatArray:
    """Project values (e, q) onto the functions of the dilatation; without any, return them as they are."""
    if not body.basis.shape[2]:
        return values
    coefficients = (body.volume * values)[:, None] @ body.basis
    return np.asarray(body.basis @ coefficients.swapaxes(1, 2))[:, :, 0]


def _orthonormal(basis: FloatArray, volume: FloatArray) -> FloatArray:
    """Orthonormalise the functions (q, r) in each element under its quadrature (e, q): (e, q, r)."""
    if not basis.shape[1]:
        return np.zeros((*volume.shape, 0))
    mass = np.einsum("qr,eq,qs->ers", basis, volume, basis, optimize=True)
    factor = np.linalg.cholesky(mass)
    return np.ascontiguousarray(
        np.linalg.solve(factor, np.broadcast_to(basis.T, (len(volume), *basis.T.shape))).transpose(0, 2, 1)
    )
