"""How much of what rows may share is taken for noise: as much as the measurements bear out."""

import typing
from dataclasses import replace

import numpy as np
import pytest
from effect_cases import there_and_back
from numpy.typing import NDArray

from estimator.diagnosis.evidence.marginal_likelihood import error_borne_out, first_order_evidence
from estimator.diagnosis.evidence.noise_evidence import FitInAnyNoise
from estimator.diagnosis.evidence.noise_selection import (
    CaseLeaving,
    in_another_case,
    most_probable_noise,
    noise_cost,
    signatures_anew,
)
from estimator.diagnosis.evidence.signatures import Signature
from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.model.free_parameters import free_parameters
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.noise.correlated_errors import CorrelatedErrors
from estimator.diagnosis.noise.errors_left import AT_MOST, ErrorsLeft
from estimator.effects.catalogue import CATALOGUE
from estimator.effects.effect import Effect
from estimator.fem.boundary.problem import RetractionProblem

FloatArray = NDArray[np.float64]
EXPERIMENT = there_and_back().experiment
SHAPE = (len(EXPERIMENT.time), 6 + 3 * len(EXPERIMENT.fiducials_rest))
MATERIAL = Hypothesis(15e3, 0.45)
AT_REST = np.tile(np.concatenate([np.zeros(6), EXPERIMENT.fiducials_rest.ravel()]), (SHAPE[0], 1))
# Of its sixteen beads these two are beside the rim of the grasp.
AT_RIM = (13, 14)


def errors_left(elsewhere: float, at_rim: tuple[float, float], at_rest: float) -> ErrorsLeft:
    """The shares of the two beads beside the rim; of the others it is what is usual, for nothing hangs on it."""
    shares = [0.25] * 16
    for bead, share in zip(AT_RIM, at_rim, strict=True):
        shares[bead] = share
    return ErrorsLeft(elsewhere, tuple(shares), at_rest)


LEAST = errors_left(0.1, (0.1, 0.1), 0.1)


def shared_errors() -> CorrelatedErrors:
    """Thirty errors of each kind that rows may share, each five times the noise wherever it shows."""
    of_each = 5.0 * np.random.default_rng(1).normal(size=(4, SHAPE[0] * SHAPE[1], 30))
    at_rest, elsewhere, *at_rim = of_each
    seen, none = np.ones(SHAPE, dtype=bool), np.zeros((SHAPE[0] * SHAPE[1], 0))
    return CorrelatedErrors(
        seen,
        np.ones(SHAPE[1]),
        np.zeros(SHAPE[1]),
        none,
        at_rest,
        elsewhere,
        dict(zip(AT_RIM, at_rim, strict=True)),
    )


PROBLEM = typing.cast(RetractionProblem, None)
case_leaving = CaseLeaving(Case((EXPERIMENT,), PROBLEM, (), (), ()), (shared_errors(),))


def fit_in(case: Case, left: ErrorsLeft) -> Linearisation:
    """A fit whose misfit is noise and those shares of what may be left."""
    rng, errors = np.random.default_rng(2), shared_errors()
    misfit = rng.normal(size=SHAPE[0] * SHAPE[1])
    misfit += left.at_rest * errors.at_rest @ rng.normal(size=30)
    misfit += left.elsewhere * errors.elsewhere @ rng.normal(size=30)
    for bead, directions in errors.beside_rim.items():
        misfit += (left.beside_rim[bead] if left.beside_rim else 1.0) * directions @ rng.normal(size=30)
    columns = np.column_stack([misfit, rng.normal(size=(len(misfit), 2))]).reshape(*SHAPE, 3)
    whitened = case.whitenings[0].apply(columns)
    free = free_parameters(MATERIAL)
    return Linearisation(MATERIAL, free, (AT_REST,), (whitened[:, 0],), (whitened[:, 1:],), (), ())


@pytest.mark.parametrize(
    "left",
    [
        errors_left(1.0, (0.1, 0.1), 0.1),
        errors_left(0.1, (1.0, 1.0), 0.25),
        errors_left(0.1, (0.1, 1.0), 0.1),
        errors_left(0.25, (0.5, 0.1), 1.0),
        LEAST,
    ],
)
def test_how_much_is_left_of_each_error_is_told_from_the_misfit(left: ErrorsLeft) -> None:
    for case in (case_leaving(AT_MOST), case_leaving(LEAST)):
        assert most_probable_noise(case_leaving, case, fit_in(case, left)).errors_left == left


@pytest.mark.parametrize("seen", [1.0, 0.8])
@pytest.mark.parametrize("correlation", [0.0, 0.4])
def test_a_noise_is_as_probable_by_inner_products_as_by_whitening(seen: float, correlation: float) -> None:
    rng, whole = np.random.default_rng(5), shared_errors()
    kept = rng.random(SHAPE) < seen
    blocks = [block[kept.ravel()] for block in (whole.always, whole.at_rest, whole.elsewhere)]
    at_rim = {bead: block[kept.ravel()] for bead, block in whole.beside_rim.items()}
    shared = CorrelatedErrors(
        kept, rng.uniform(0.5, 2.0, SHAPE[1]), np.full(SHAPE[1], correlation), *blocks, at_rim
    )
    experiment = replace(EXPERIMENT, wrench=np.where(kept[:, :6], EXPERIMENT.wrench, np.nan))
    cases = CaseLeaving(Case((experiment,), PROBLEM, (), (), ()), (shared,))
    case = cases(errors_left(0.25, (1.0, 0.5), 0.5))
    columns = 10.0 * case.whitenings[0].apply(rng.normal(size=(*SHAPE, 3)))
    fit = replace(fit_in(case_leaving(LEAST), LEAST), residual=(columns[:, 0],), jacobian=(columns[:, 1:],))
    by_products = FitInAnyNoise.of(case, fit, cases.shared)
    for left in (AT_MOST, LEAST, errors_left(0.25, (0.1, 1.0), 0.5)):
        there = cases(left)
        moved = in_another_case(fit, case, there)
        directly = first_order_evidence(there, moved, error_borne_out(there, moved)) - noise_cost(there)
        assert by_products.log_density(left) == pytest.approx(directly, rel=1e-9)


def test_a_fit_is_the_same_in_every_noise_but_for_its_whitening() -> None:
    most, least, left = case_leaving(AT_MOST), case_leaving(LEAST), errors_left(0.5, (0.25, 0.5), 0.25)
    anew, direct = in_another_case(fit_in(most, left), most, least), fit_in(least, left)
    np.testing.assert_allclose(anew.residual[0], direct.residual[0], atol=1e-9)
    np.testing.assert_allclose(anew.jacobian[0], direct.jacobian[0], atol=1e-9)
    assert noise_cost(least) < noise_cost(most)


def test_signatures_go_over_to_another_noise_as_if_they_had_been_whitened_by_it() -> None:
    most, least = case_leaving(AT_MOST), case_leaving(LEAST)
    channels = np.random.default_rng(4).normal(size=(*SHAPE, 7))
    named = {effect.name: effect for effect in CATALOGUE}
    effects = [named["motion_scale:translation"], named["force_bias:sensor_frame"]]

    def whitened_by(case: Case) -> list[Signature]:
        columns = case.whitenings[0].apply(channels)
        parts = (columns[:, :1], columns[:, 1:])
        return [
            Signature(effect, {}, free_parameters(MATERIAL.with_effect(effect, nothing(effect)))[2:], (part,))
            for effect, part in zip(effects, parts, strict=True)
        ]

    def nothing(effect: Effect) -> dict[str, float]:
        return {amplitude.name: 0.0 for amplitude in effect.amplitudes}

    anew, direct = signatures_anew(whitened_by(most), most, least), whitened_by(least)
    for one, other in zip(anew, direct, strict=True):
        assert one.effect is other.effect
        np.testing.assert_allclose(one.columns[0], other.columns[0], atol=1e-9)


def test_all_that_meshes_may_leave_of_one_bead_beside_the_rim_leaves_the_rest_as_sharp() -> None:
    rng, errors = np.random.default_rng(3), shared_errors()

    def size(left: ErrorsLeft, directions: FloatArray) -> float:
        misfit = (directions @ rng.normal(size=30)).reshape(*SHAPE, 1)
        return float(np.linalg.norm(errors.whitening(left).apply(misfit)) / np.linalg.norm(misfit))

    open_at_rim = errors_left(0.1, (0.1, 1.0), 0.1)
    for kept in (errors.elsewhere, errors.beside_rim[13]):
        assert size(open_at_rim, kept) == pytest.approx(size(LEAST, kept), rel=0.05)
    assert size(open_at_rim, errors.beside_rim[14]) < 0.2 * size(LEAST, errors.beside_rim[14])
