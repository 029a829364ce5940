"""How much of what meshes may leave is taken for noise: as much as the measurements bear out."""

import typing

import numpy as np
import pytest
from effect_cases import there_and_back
from numpy.typing import NDArray

from estimator.diagnosis.case import Case, Linearisation
from estimator.diagnosis.hypothesis import Hypothesis, coordinates
from estimator.diagnosis.sharpening import noise_cost, sharpest, whitened_anew
from estimator.diagnosis.whitening import Whitening, inverse_root
from estimator.fem.problem import RetractionProblem

FloatArray = NDArray[np.float64]
SHARES = (1.0, 0.6, 0.35, 0.2)
EXPERIMENT = there_and_back().experiment
SHAPE = (len(EXPERIMENT.time), 6 + 3 * len(EXPERIMENT.fiducials_rest))
MATERIAL = Hypothesis(15e3, 0.45)
AT_REST = np.tile(np.concatenate([np.zeros(6), EXPERIMENT.fiducials_rest.ravel()]), (SHAPE[0], 1))


def left_by_meshes() -> FloatArray:
    """Sixty errors that rows share, each five times the noise of one value wherever it shows."""
    return 5.0 * np.random.default_rng(1).normal(size=(SHAPE[0] * SHAPE[1], 60))


def cases() -> list[Case]:
    seen, ones, problem = np.ones(SHAPE, dtype=bool), np.ones(SHAPE[1]), typing.cast(RetractionProblem, None)
    return [
        Case(
            (EXPERIMENT,),
            problem,
            (),
            (Whitening(seen, ones, np.zeros(SHAPE[1]), *inverse_root(share * left_by_meshes())),),
            (),
            share,
        )
        for share in SHARES
    ]


def fit_in(case: Case, share: float) -> Linearisation:
    """A fit whose misfit is noise and that share of what meshes may leave."""
    rng = np.random.default_rng(2)
    misfit = rng.normal(size=SHAPE[0] * SHAPE[1]) + share * left_by_meshes() @ rng.normal(size=60)
    columns = np.column_stack([misfit, rng.normal(size=(len(misfit), 2))]).reshape(*SHAPE, 3)
    whitened = case.whitenings[0].apply(columns)
    free = coordinates(MATERIAL)
    return Linearisation(MATERIAL, free, (AT_REST,), (whitened[:, 0],), (whitened[:, 1:],), (), ())


@pytest.mark.parametrize("share", SHARES)
def test_what_meshes_left_is_told_from_the_misfit(share: float) -> None:
    several = cases()
    for case in (several[0], several[-1]):
        assert sharpest(several, case, fit_in(case, share)).left_by_meshes == share


def test_a_fit_is_the_same_in_every_noise_but_for_its_whitening() -> None:
    most, *_, least = cases()
    anew, direct = whitened_anew(fit_in(most, 0.6), most, least), fit_in(least, 0.6)
    np.testing.assert_allclose(anew.residual[0], direct.residual[0], atol=1e-9)
    np.testing.assert_allclose(anew.by_coordinate[0], direct.by_coordinate[0], atol=1e-9)
    assert noise_cost(least) < noise_cost(most)
