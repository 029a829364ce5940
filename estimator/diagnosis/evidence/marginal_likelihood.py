"""The log evidence of one linearised hypothesis: its moments, the priors of what is free in it, the price of choice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.evidence.discrepancy import ModelError, Moments, model_error_of, moments_of
from estimator.diagnosis.evidence.laplace import (
    Priors,
    log_mean,
    over_floors,
    unknown_evidence,
    with_floor_borne_out,
)
from estimator.diagnosis.evidence.row_errors import evidence_of_unsteadiness
from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.fitting.gauss_newton import newton_step
from estimator.diagnosis.model.free_parameters import FreeParameter
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.settings import DiagnosisSettings, EvidenceSettings

FloatArray = NDArray[np.float64]


def error_borne_out(case: Case, fit: Linearisation) -> ModelError:
    """Return what any model misses of a case, by the size of a fit's channels and of its misfit."""
    error = model_error_of(case.experiments, case.whitenings, fit.predicted, case.settings.evidence)
    return with_floor_borne_out(error, *linear_model(case, fit, error))


def evidence_of_unknown(case: Case, fit: Linearisation, error: ModelError) -> float:
    """Weigh something outside the catalogue beside a fit: what is smooth, or rows that are off by themselves.

    One is as likely as the other beforehand. The larger of both would make something unknown of two clean cases in
    70, whose rows seem to be off by 1.8 in log evidence.
    """
    model = linear_model_within_reach(case, fit, error)
    by_rows = evidence_of_unsteadiness(fit.residual, case.whitenings, fit.predicted, case.settings.evidence)
    found = log_mean([unknown_evidence(*model, error), over_floors(*model, error) + by_rows])
    return found - price_of_choice(case, fit.hypothesis)


def first_order_evidence(case: Case, fit: Linearisation, error: ModelError) -> float:
    """Weigh a linearised hypothesis, over all floors of what every model misses."""
    return over_floors(*linear_model(case, fit, error), error) - price_of_choice(case, fit.hypothesis)


def price_of_choice(case: Case, hypothesis: Hypothesis) -> float:
    """Return what choosing the fixed constants costs: the log of among how many, equally likely beforehand."""
    return float(sum(np.log(effect.choices(case.experiments)) for effect in hypothesis.effects))


def linear_model(case: Case, fit: Linearisation, error: ModelError) -> tuple[Moments, Priors]:
    """Return a linearisation's moments, of its residual first, and the priors of what is free in it."""
    stacked = [np.column_stack(pair) for pair in zip(fit.residual, fit.jacobian, strict=True)]
    return moments_of(error, stacked), priors_within_a_step(
        fit.hypothesis, fit.free_parameters, case.settings
    )


def linear_model_within_reach(case: Case, fit: Linearisation, error: ModelError) -> tuple[Moments, Priors]:
    """Return the same of a refitted hypothesis: nothing goes farther than where a step from there may still fit better.

    At a kink the derivatives promise what no step keeps.
    """
    moments, priors = linear_model(case, fit, error)
    if fit.next_share == 1.0:
        return moments, priors
    reach = fit.next_share * np.abs(newton_step(fit, case.settings.fitting)[0])
    within = replace(priors, lower=np.maximum(priors.lower, -reach), upper=np.minimum(priors.upper, reach))
    return moments, within


def priors_within_a_step(
    hypothesis: Hypothesis, free: Sequence[FreeParameter], settings: DiagnosisSettings
) -> Priors:
    """Return the priors with constants bound to where the next step of a refit may take them.

    What derivatives promise of a constant far away, where the effect is small, is mostly not there, and would raise the
    evidence beyond that at the best constant.
    """
    priors = priors_of(hypothesis, free, settings.evidence)
    constants = [c.scale is not None and not c.has_null for c in free]
    reach = np.where(constants, settings.fitting.longest_of_a_range * priors.scale, np.inf)
    return replace(priors, lower=np.maximum(priors.lower, -reach), upper=np.minimum(priors.upper, reach))


def priors_of(hypothesis: Hypothesis, free: Sequence[FreeParameter], settings: EvidenceSettings) -> Priors:
    """Return the priors of what is free at a hypothesis, and its bounds as seen from there."""
    values = np.array([c.get(hypothesis) for c in free])
    scale = np.array([np.inf if c.scale is None else c.scale for c in free])
    centre = np.array([c.prior_offset(hypothesis) for c in free])
    lower = np.array([c.internal_of(c.lower) if np.isfinite(c.lower) else -np.inf for c in free])
    upper = np.array([c.internal_of(c.upper) if np.isfinite(c.upper) else np.inf for c in free])
    amplitude_of = np.array([c.effect if c.has_null and c.effect is not None else -1 for c in free])
    return Priors(centre, scale, lower - values, upper - values, amplitude_of, settings.sizes, settings.shows)
