"""How a hypothesis is weighed by its derivatives."""

import numpy as np
import pytest
from bare_contexts import bare_case, bare_context, no_error_in
from numpy.typing import NDArray
from retraction_cases import REFERENCE_BLOCK

from estimator.diagnosis.evidence.discrepancy import Discrepancy, ModelError
from estimator.diagnosis.evidence.marginal_likelihood import evidence_of_unknown, first_order_evidence
from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.model.free_parameters import free_parameters
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.search.candidate import candidate_of
from estimator.effects.catalogue import CATALOGUE
from estimator.inference.whitening import Whitening

NOTHING = np.zeros((400, 1))
NO_ERROR = no_error_in(Discrepancy((NOTHING, NOTHING), (np.zeros(1), np.zeros(1))))
CASE = bare_case((REFERENCE_BLOCK,))


def evidence_of_drift(misfit: float, by_time_constant: float) -> float:
    """Log evidence of a drift that settles, whose time constant would explain a misfit if it could go where it likes.

    Both are in units of the noise, the latter for a change of the constant's logarithm by one.
    """
    drift = next(one for one in CATALOGUE if one.name == "force_drift:saturating_sensor_frame")
    values = {amplitude.name: amplitude.smallest for amplitude in drift.amplitudes}
    hypothesis = Hypothesis(15e3, 0.45).with_effect(drift, {**values, "time_constant": 60.0})
    free = free_parameters(hypothesis)
    columns = np.linalg.qr(np.random.default_rng(5).normal(size=(400, len(free))))[0]
    residual = misfit * columns[:, -1]
    columns[:, -1] *= by_time_constant
    fit = Linearisation(hypothesis, free, (), (residual,), (columns,), (), ())
    return first_order_evidence(CASE, fit, NO_ERROR)


def test_what_a_constant_would_explain_far_away_does_not_count() -> None:
    # It is e⁴ times as large, by its derivative, that the time constant would explain the whole misfit of 8 nats.
    assert evidence_of_drift(4.0, 1.0) < evidence_of_drift(4.0, 1e-9) + 1.0


def test_what_it_would_explain_nearby_does() -> None:
    assert evidence_of_drift(4.0, 40.0) > evidence_of_drift(4.0, 1e-9) + 2.0


def in_plain_noise(rows: int, channels: int) -> tuple[Case, ModelError]:
    """A case whose noise is white and of unit size, and of which no model misses anything."""
    seen, nothing = np.ones((rows, channels), dtype=bool), np.zeros((rows * channels, 1))
    plain = Whitening(seen, np.ones(channels), np.zeros(channels), nothing, np.zeros(1))
    error = no_error_in(Discrepancy((nothing, nothing), (np.zeros(1), np.zeros(1))))
    return bare_case((REFERENCE_BLOCK,), (plain,)), error


def evidence_where_steps_are_refused(next_share: float) -> float:
    """Log evidence of a refitted bias whose derivatives promise 8 nats, of which a share of a step may be kept."""
    rows, channels = 8, 54
    case, error = in_plain_noise(rows, channels)
    bias = next(one for one in CATALOGUE if one.name == "force_bias:sensor_frame_fx")
    hypothesis = Hypothesis(15e3, 0.45).with_effect(bias, {"bias_fx": 0.01})
    free = free_parameters(hypothesis)
    columns = np.linalg.qr(np.random.default_rng(5).normal(size=(rows * channels, len(free))))[0]
    residual = 4.0 * columns[:, -1]
    columns[:, -1] *= 1e3
    predicted = (np.zeros((rows, channels)),)
    fit = Linearisation(hypothesis, free, predicted, (residual,), (columns,), (), (), next_share=next_share)
    return candidate_of(bare_context(fit, case, error), fit).log_evidence


def test_what_derivatives_promise_counts_as_far_as_a_step_may_still_fit_better() -> None:
    whole, third, nothing = map(evidence_where_steps_are_refused, (1.0, 1 / 3, 0.0))
    assert whole - nothing == pytest.approx(8.0, abs=0.5)
    assert third - nothing == pytest.approx(8.0 * (1 - (2 / 3) ** 2), abs=0.5)


def gained_by_unknown(misfit: NDArray[np.float64]) -> float:
    """What something unknown adds to a fit's log evidence, in a misfit (n, 6 + 3m) of which no part is smooth."""
    rows, channels = misfit.shape
    case, error = in_plain_noise(rows, channels)
    hypothesis = Hypothesis(15e3, 0.45)
    columns = np.random.default_rng(8).normal(size=(misfit.size, 2))
    free = free_parameters(hypothesis)
    fit = Linearisation(
        hypothesis, free, (np.zeros((rows, channels)),), (misfit.ravel(),), (columns,), (), ()
    )
    return evidence_of_unknown(case, fit, error) - first_order_evidence(case, fit, error)


def test_beads_that_shake_in_single_rows_speak_for_something_unknown_and_noise_does_not() -> None:
    rng = np.random.default_rng(9)
    noise = rng.normal(size=(150, 54))
    shaken = noise.copy()
    shaken[:, 6:] += np.tile(0.2 * rng.normal(size=(150, 3)), 16)
    # Of two kinds as likely beforehand one does as well as nothing here, the other worse: their mean is between.
    assert -np.log(2.0) < gained_by_unknown(noise) < -0.1
    assert gained_by_unknown(shaken) > 5.0
