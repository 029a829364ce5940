"""The log evidence of one linearised hypothesis: its moments, the priors of what is free in it, the price of choice."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.evidence.discrepancy import ModelError, Moments, model_error_of, moments_of
from estimator.diagnosis.evidence.floors import over_floors, unknown_evidence, with_floor_borne_out
from estimator.diagnosis.evidence.row_errors import evidence_of_unsteadiness
from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.model.free_parameters import HypothesisParameter
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.settings import EvidenceSettings
from estimator.inference.gauss_newton import newton_step
from estimator.inference.laplace import Priors, log_mean
from estimator.inference.linear_model import stacked

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
    priors = priors_within_a_step(fit.free_parameters, case.settings.evidence)
    return moments_of(error, stacked(fit)), priors


def linear_model_within_reach(case: Case, fit: Linearisation, error: ModelError) -> tuple[Moments, Priors]:
    """Return the same of a refitted hypothesis: nothing goes farther than where a step from there may still fit better.

    At a kink the derivatives promise what no step keeps.
    """
    moments, priors = linear_model(case, fit, error)
    if fit.next_share < 1.0:
        priors = priors.within(fit.next_share * np.abs(newton_step(fit).step))
    return moments, priors


def priors_within_a_step(free: Sequence[HypothesisParameter], settings: EvidenceSettings) -> Priors:
    """Return the priors with constants bound to where the next step of a refit may take them.

    What derivatives promise of a constant far away, where the effect is small, is mostly not there, and would raise the
    evidence beyond that at the best constant.
    """
    constants = [c.effect is not None and not c.pulled_to_null for c in free]
    return priors_of(free, settings).within(np.where(constants, [c.longest_step for c in free], np.inf))


def priors_of(free: Sequence[HypothesisParameter], settings: EvidenceSettings) -> Priors:
    """Return the priors of what is free in a hypothesis, and its bounds as seen from there."""
    together = [c.effect if c.pulled_to_null and c.effect is not None else -1 for c in free]
    return Priors.of(free, [c.effect is None for c in free], together, settings.sizes, settings.shows)
