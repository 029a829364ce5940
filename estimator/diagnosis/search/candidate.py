"""A refitted hypothesis, weighed by its evidence."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.evidence.discrepancy import ModelError, forgiven, moments_of
from estimator.diagnosis.evidence.floors import marginal_evidence
from estimator.diagnosis.evidence.marginal_likelihood import linear_model_within_reach, price_of_choice
from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.search.context import Context
from estimator.inference.free_parameter import prior_information
from estimator.inference.linear_model import chi2_of

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Candidate:
    """A refitted hypothesis.

    Attributes
    ----------
    fit : at its best parameters
    log_evidence : with the inexactness of its signatures integrated out
    deviations : (p,) standard deviations of its internal variables
    fell : by how much its objective fell in its last refit; infinite where that did not begin at a point of its own
    """

    fit: Linearisation
    log_evidence: float
    deviations: FloatArray
    fell: float = math.inf

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of its effects."""
        return tuple(effect.label for effect in self.fit.hypothesis.effects)


def most_probable_first(candidates: Iterable[Candidate]) -> list[Candidate]:
    """Return candidates by their log evidence, the highest first."""
    return sorted(candidates, key=lambda one: -one.log_evidence)


def best_of_labels(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Return the first of each label, of candidates in order: its other forms mostly leave the same."""
    found: dict[str, Candidate] = {}
    for one in candidates:
        found.setdefault(one.labels[0], one)
    return list(found.values())


def is_determined(fit: Linearisation) -> bool:
    """Tell whether what was measured depends on every parameter of which nothing is known beforehand.

    Where a cause hides all of it, as a sensor that clips every one of a few forces, E may be anything, and so may the
    evidence.
    """
    depends = np.sum([np.square(columns).sum(axis=0) for columns in fit.jacobian], axis=0) > 0.0
    return all(known for one, known in zip(fit.free_parameters, depends, strict=True) if one.prior is None)


def candidate_of(context: Context, fit: Linearisation) -> Candidate:
    """Weigh a refitted hypothesis."""
    case, error = context.case, context.error
    model = linear_model_within_reach(case, fit, error)
    value, inexactness = marginal_evidence(*model, error, explained(case, context.baseline, fit))
    value -= price_of_choice(case, fit.hypothesis)
    return Candidate(fit, value, parameter_deviations(fit, error, inexactness))


def parameter_deviations(
    fit: Linearisation,
    error: ModelError,
    inexactness: tuple[float, float],
    residual: Sequence[FloatArray] | None = None,
) -> FloatArray:
    """Return the standard deviation (p,) of each internal variable, priors and what the model misses included.

    Where the misfit stands above the noise the measurements tell the less: by as much as it does, like noise of that
    size.

    Parameters
    ----------
    fit : at its best parameters
    error : what any model misses
    inexactness : the amplitude of what this one misses, in wrench and fiducials
    residual : of each experiment (r,), what is left where that is not what the fit leaves
    """
    gram, _ = forgiven(error, moments_of(error, fit.jacobian), inexactness)
    information = prior_information(fit.free_parameters) + gram / misfit_ratio(fit, residual) ** 2
    return np.asarray(np.sqrt(np.diag(np.linalg.inv(information))))


def misfit_ratio(fit: Linearisation, residual: Sequence[FloatArray] | None = None) -> float:
    """Return the root mean square misfit in units of the noise, 1 where it is no more than that."""
    left = fit.residual if residual is None else residual
    values = sum(len(each) for each in left) - len(fit.free_parameters)
    return max(1.0, math.sqrt(chi2_of(left) / max(values, 1)))


def explained(case: Case, base: Linearisation, fit: Linearisation) -> FloatArray:
    """Return the root mean square (2,) of what a fit changes in wrench and fiducials, in units of the noise."""
    squares, counts = np.zeros(2), np.zeros(2)
    for before, after, whitening in zip(base.predicted, fit.predicted, case.whitenings, strict=True):
        change = ((after - before) / whitening.deviation) ** 2
        squares += [change[:, :6].sum(), change[:, 6:].sum()]
        counts += [change[:, :6].size, change[:, 6:].size]
    return np.asarray(np.sqrt(squares / np.maximum(counts, 1)))
