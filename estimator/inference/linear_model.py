"""A model linearised at a point: its whitened misfit and the derivatives by its free parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from estimator.inference.free_parameter import FreeParameter

FloatArray = NDArray[np.float64]


class LinearModel(Protocol):
    """A model linearised at the values of its free parameters; unit variance and independent, block by block."""

    @property
    def free_parameters(self) -> Sequence[FreeParameter]:
        """The p parameters at their present values."""
        ...

    @property
    def residual(self) -> Sequence[FloatArray]:
        """Measured minus predicted, (r,) of each block."""
        ...

    @property
    def jacobian(self) -> Sequence[FloatArray]:
        """Derivative of the prediction by the internal variables, (r, p) of each block."""
        ...


def stacked(model: LinearModel) -> list[FloatArray]:
    """Return residual and derivatives of each block side by side, (r, 1 + p)."""
    return [np.column_stack(pair) for pair in zip(model.residual, model.jacobian, strict=True)]


def gram_of(blocks: Sequence[FloatArray]) -> FloatArray:
    """Return the Gram matrix (k, k) of columns that are given block by block."""
    return np.asarray(np.sum([block.T @ block for block in blocks], axis=0))


def chi2_of(residual: Sequence[FloatArray]) -> float:
    """Return the sum of the squares of a whitened misfit."""
    return float(sum(r @ r for r in residual))


def objective(model: LinearModel) -> float:
    """Return half of χ² plus the priors' share: the negative log posterior up to a constant."""
    return negative_log_posterior(chi2_of(model.residual), model.free_parameters)


def negative_log_posterior(chi2: float, free: Sequence[FreeParameter]) -> float:
    """Return half of χ² plus the share of the priors at the present values."""
    offsets = [parameter.prior_offset for parameter in free]
    return 0.5 * chi2 + 0.5 * float(np.sum(np.square(offsets)))
