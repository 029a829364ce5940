"""How a hypothesis is weighed by its derivatives."""

import typing

import numpy as np
from retraction_cases import REFERENCE_BLOCK

from estimator.diagnosis.case import Case, Linearisation
from estimator.diagnosis.contest import first_order_evidence
from estimator.diagnosis.discrepancy import Discrepancy, ModelError
from estimator.diagnosis.hypothesis import Hypothesis, coordinates
from estimator.effects.catalogue import CATALOGUE
from estimator.fem.problem import RetractionProblem

NOTHING = np.zeros((400, 1))
NO_ERROR = ModelError(
    (Discrepancy((NOTHING, NOTHING), (np.zeros(1), np.zeros(1))),), ((0.0, 0.0),), (0.0, 0.0)
)
CASE = Case((REFERENCE_BLOCK,), typing.cast(RetractionProblem, None), (), (), ())


def evidence_of_drift(misfit: float, by_time_constant: float) -> float:
    """Log evidence of a drift that settles, whose time constant would explain a misfit if it could go where it likes.

    Both are in units of the noise, the latter for a change of the constant's logarithm by one.
    """
    drift = next(one for one in CATALOGUE if one.name == "force_drift:saturating_sensor_frame")
    values = {amplitude.name: amplitude.smallest for amplitude in drift.amplitudes}
    hypothesis = Hypothesis(15e3, 0.45).with_effect(drift, {**values, "time_constant": 60.0})
    free = coordinates(hypothesis)
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
