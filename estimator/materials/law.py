"""The form that every isotropic law of the project has.

The strain energy per reference volume is

    W = μ w(I1, I2, J; s) + λ/2 (J − 1)²

with I1 = tr C, I2 = ½(I1² − tr C²), J = det F of the full deformation (nothing is split off), Lamé's μ and λ,
and dimensionless shape parameters s. A law states w alone. It is normalised so that μ and λ keep their
small-strain meaning: w = ε:ε + O(ε³) for a small strain ε. Two arguments that are built to do so carry over
the classical incompressible laws, to which they reduce at J = 1:

    x = I1 − 3 − 2 ln J,        y = I2 − 3 − 4 ln J − 2 (ln J)²

One law, St. Venant's and Kirchhoff's, has tr E in the place of J − 1.

Every shape parameter has a null value at which the law becomes the Neo-Hookean one, w = x/2. That is the law
of the paper's eq. (4): W = ½[μ(i₁−3) − μ ln i₃ + λ(√i₃−1)²] with i₃ = J².
"""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ShapeParameter:
    """A dimensionless parameter of a law: its null value (Neo-Hookean), bounds and a typical scale."""

    name: str
    null: float
    lower: float
    upper: float
    scale: float


@dataclass(frozen=True, slots=True)
class EnergyDerivatives:
    """The energy w and its derivatives at n points.

    Attributes
    ----------
    value : (n,) w
    first : (3, n) by I1, I2, J
    second : (6, n) by I1I1, I1I2, I1J, I2I2, I2J, JJ
    first_by_shape : (k, 3, n) derivative of ``first`` by each shape parameter
    dilatation_by : derivatives by I1, I2, J of the measure θ of volume change, linear in them and zero at rest, of
        which the volumetric energy is λ/2 θ²
    """

    value: FloatArray
    first: FloatArray
    second: FloatArray
    first_by_shape: FloatArray
    dilatation_by: tuple[float, float, float] = (0.0, 0.0, 1.0)


@runtime_checkable
class Law(Protocol):
    """An isotropic hyperelastic law in the form above.

    Examples
    --------
    >>> from estimator import Law
    >>> from estimator.materials import law_named
    >>> isinstance(law_named("gent"), Law), isinstance("gent", Law)
    (True, False)
    """

    @property
    def name(self) -> str:
        """Its name in the table of laws and in reports."""

    @property
    def shape_parameters(self) -> tuple[ShapeParameter, ...]:
        """What ``shape`` holds, in this order; empty for the Neo-Hookean law."""

    def derivatives(
        self, i1: FloatArray, i2: FloatArray, j: FloatArray, shape: FloatArray
    ) -> EnergyDerivatives:
        """Evaluate w at n points; ``i1``, ``i2``, ``j`` have shape (n,), ``shape`` (k,).

        Raises
        ------
        SolverError
            A point lies where the law has no energy (J ≤ 0, or beyond a limit of its own).
        """
