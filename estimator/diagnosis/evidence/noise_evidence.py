"""How probable a fit's misfit is in the noise that goes with what is left of the errors that rows share.

To whiten thousands of values anew for every such noise would take most of a choice among many. An evidence takes inner
products alone: of the misfit, the derivatives and everything smooth with each other, and with the errors that rows may
share. These serve any share of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.evidence.discrepancy import ModelError, discrepancy_along, floors_of, smooth_misfits
from estimator.diagnosis.evidence.floors import with_floor_borne_out
from estimator.diagnosis.evidence.marginal_likelihood import first_order_evidence, linear_model
from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.noise.correlated_errors import CorrelatedErrors
from estimator.diagnosis.noise.errors_left import ErrorsLeft
from estimator.experiment import Experiment
from estimator.inference.inner_products import InnerProducts, columns_with
from estimator.inference.linear_model import stacked
from estimator.inference.whitening import Whitening, uncorrelated


@dataclass(frozen=True, eq=False)
class FitInAnyNoise:
    """A fit of a case, by inner products.

    Attributes
    ----------
    case, fit : in one noise
    shared : of each experiment, the errors that its rows may share
    products : of each, the columns being the misfit, p derivatives, and what is smooth in wrench and in fiducials
    smooth_columns : of each, how many are of the wrench
    floors : that even the right model may miss
    """

    case: Case
    fit: Linearisation
    shared: Sequence[CorrelatedErrors]
    products: Sequence[InnerProducts]
    smooth_columns: Sequence[int]
    floors: tuple[tuple[float, float], ...]

    @classmethod
    def of(cls, case: Case, fit: Linearisation, shared: Sequence[CorrelatedErrors]) -> FitInAnyNoise:
        """Return a fit of a case, both in one of the noises."""
        settings, products, smooth_columns = case.settings.evidence, [], []
        whole = zip(case.experiments, case.whitenings, shared, stacked(fit), strict=True)
        for experiment, whitening, errors, columns in whole:
            smooth = _smooth(experiment, whitening, case)
            everything = np.hstack([whitening.with_shared(columns), *smooth])
            directions, of_directions = errors.at_most
            products.append(
                InnerProducts(everything.T @ everything, of_directions, directions.T @ everything)
            )
            smooth_columns.append(smooth[0].shape[1])
        floors = floors_of(case.experiments, case.whitenings, fit.predicted, settings)
        return cls(case, fit, shared, products, smooth_columns, floors)

    def log_density(self, left: ErrorsLeft) -> float:
        """Return the log evidence where so much is left, with what that noise itself costs."""
        residual, jacobian, processes, cost = [], [], [], 0.0
        own = 1 + len(self.fit.free_parameters)
        for errors, products, of_wrench in zip(self.shared, self.products, self.smooth_columns, strict=True):
            inner, log_determinant = products.whitened(errors.sizes(left))
            columns = columns_with(inner)
            residual.append(columns[:, 0])
            jacobian.append(columns[:, 1:own])
            processes.append(
                discrepancy_along(columns[:, own : own + of_wrench], columns[:, own + of_wrench :])
            )
            cost += 0.5 * log_determinant
        fit = replace(self.fit, residual=tuple(residual), jacobian=tuple(jacobian))
        error = ModelError(tuple(processes), self.floors, self.floors[0], self.case.settings.evidence)
        error = with_floor_borne_out(error, *linear_model(self.case, fit, error))
        return first_order_evidence(self.case, fit, error) - cost


def _smooth(experiment: Experiment, whitening: Whitening, case: Case) -> list[np.ndarray]:
    """Return what is smooth in wrench and in fiducials, (r, k) each, free of the rows' correlation."""
    parts = smooth_misfits(experiment, case.settings.evidence)
    return [uncorrelated(part, whitening.seen, whitening.correlation) for part in parts]
