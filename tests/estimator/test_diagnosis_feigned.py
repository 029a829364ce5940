"""What the model's own error could feign: with quieter sensors evidence for a cause saturates instead of growing."""

import typing
from dataclasses import replace

import numpy as np
import pytest
from bare_contexts import bare_context, no_error_in
from numpy.typing import NDArray
from retraction_cases import SMALL_BLOCK

from estimator.diagnosis.evidence.discrepancy import Discrepancy
from estimator.diagnosis.evidence.feigned import feigned_evidence
from estimator.diagnosis.evidence.marginal_likelihood import first_order_evidence
from estimator.diagnosis.evidence.posterior import probabilities
from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.model.free_parameters import free_parameters
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.noise.errors_left import AT_MOST
from estimator.diagnosis.search.candidate import Candidate
from estimator.diagnosis.search.comparison import Comparison
from estimator.diagnosis.search.models import ModelTable
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.effects.catalogue import CATALOGUE, LABELS
from estimator.fem.boundary.problem import RetractionProblem
from estimator.inference.whitening import Whitening

FloatArray = NDArray[np.float64]

MATERIAL = Hypothesis(15e3, 0.45)
SETTINGS = DiagnosisSettings()
ROWS, CHANNELS = 60, 6 + 3 * 4
RNG = np.random.default_rng(3)
# What an effect does to the beads, m, what of E and ν does, and what a finer mesh changes.
CHANGE = np.zeros((ROWS, CHANNELS))
CHANGE[:, 6:] = 1.5e-6 * np.linspace(0.0, 1.0, ROWS)[:, None] ** 3 * RNG.normal(size=CHANNELS - 6)
OF_MATERIAL = RNG.normal(size=(ROWS, CHANNELS, 2))
# E and ν can do nothing of it.
OF_MATERIAL -= CHANGE[:, :, None] * np.einsum("nc,nck->k", CHANGE, OF_MATERIAL) / np.sum(CHANGE**2)
CORRECTION = np.zeros((ROWS, CHANNELS))
CORRECTION[:, 6:] = 3e-5 * np.linspace(0.0, 1.0, ROWS)[:, None]
NOTHING = np.zeros((ROWS * CHANNELS, 1))
ERROR = no_error_in(Discrepancy((NOTHING, NOTHING), (np.zeros(1), np.zeros(1))))


def measured_with(
    noise_m: float, correction: FloatArray = CORRECTION, left: float = 0.25
) -> tuple[Case, Linearisation]:
    """A case whose misfit is the effect's change, with sensors of some noise, and its baseline."""
    deviation = np.concatenate([np.full(3, 0.02), np.full(3, 5e-4), np.full(CHANNELS - 6, noise_m)])
    seen = np.ones((ROWS, CHANNELS), dtype=bool)
    white = Whitening(seen, deviation, np.zeros(CHANNELS), np.zeros((seen.size, 0)), np.zeros(0))
    none = typing.cast(RetractionProblem, None)
    left_of_meshes = replace(AT_MOST, elsewhere=left)
    case = Case((SMALL_BLOCK,), none, (), (correction,), (white,), errors_left=left_of_meshes)
    base = Linearisation(
        MATERIAL,
        free_parameters(MATERIAL),
        (np.zeros((ROWS, CHANNELS)),),
        (white.apply(CHANGE[:, :, None])[:, 0],),
        (white.apply(OF_MATERIAL * deviation[:, None]),),
        (),
        (),
    )
    return case, base


def explained(base: Linearisation) -> float:
    """What the effect raises the log evidence by at the most."""
    return 0.5 * base.chi2


def believed(noise_m: float) -> tuple[float, float]:
    """What the effect explains, and how much of it meshes could not feign."""
    case, base = measured_with(noise_m)
    feigned = feigned_evidence(case, base, ERROR, (CHANGE,))
    assert 0.0 <= feigned <= explained(base)
    return explained(base), explained(base) - feigned


def test_what_a_cause_explains_beyond_what_meshes_may_leave_hardly_grows_however_quiet_the_sensors() -> None:
    usual, quiet, quieter = (believed(noise) for noise in (5e-5, 4e-7, 8e-8))
    assert usual[1] == pytest.approx(usual[0], rel=0.1)
    assert quieter[0] == pytest.approx(25.0 * quiet[0])
    # What is left grows with the logarithm of a prior's width alone.
    assert quieter[1] < quiet[1] + np.log(5.0) + 0.5
    assert quieter[1] < 0.02 * quieter[0]


def test_with_usual_sensors_next_to_nothing_is_feigned_and_without_a_mesh_s_error_nothing() -> None:
    case, base = measured_with(5e-5)
    assert feigned_evidence(case, base, ERROR, (CHANGE,)) < 0.3
    exact, base = measured_with(5e-8, 0.0 * CORRECTION)
    assert feigned_evidence(exact, base, ERROR, (CHANGE,)) == 0.0
    unknown = replace(exact, corrections=())
    assert feigned_evidence(unknown, base, ERROR, (CHANGE,)) == 0.0


@pytest.mark.parametrize(
    ("name", "by_a_mesh"),
    [("anisotropy", True), ("camera_scale:of_the_motion", True), ("force_axis_gain:fx", False)],
)
@pytest.mark.parametrize("left", [CORRECTION, 0.0 * CORRECTION], ids=["left", "none left"])
def test_micrometres_that_a_mesh_may_leave_are_neither_the_tissue_s_doing_nor_a_camera_s(
    name: str, by_a_mesh: bool, left: FloatArray
) -> None:
    case, base = measured_with(1e-6, left)
    effect = next(one for one in CATALOGUE if one.name == name)
    constants = {constant.name: constant.grid[0] for constant in effect.constants}
    values = {**constants, **{one.name: one.smallest for one in effect.amplitudes}}
    hypothesis = MATERIAL.with_effect(effect, values)
    fit = replace(
        base, hypothesis=hypothesis, free_parameters=free_parameters(hypothesis), predicted=(CHANGE,)
    )
    gain = explained(base) - 4.0
    assert gain > 30.0
    none = first_order_evidence(case, base, ERROR)
    comparison = Comparison(
        bare_context(base, case, ERROR),
        0,
        (),
        (Candidate(fit, none + gain, np.zeros(2)),),
        none=none,
        unknown=none - 5.0,
    )
    evidence = {
        "none": none,
        "unknown": none - 5.0,
        **dict.fromkeys(LABELS, none - 1.0),
        effect.label: none + gain,
    }
    found = probabilities(evidence, SETTINGS.evidence, comparison.feigned)
    mesh_errs = by_a_mesh and bool(left.any())
    assert (found[effect.label] > 0.9) is not mesh_errs
    assert (found["none"] > 0.5) is mesh_errs


def fitted(base: Linearisation, predicted: FloatArray, **sizes: float) -> Linearisation:
    """A fit of some effects by name, each of one amplitude, that sees of them as much as of noise."""
    hypothesis = MATERIAL
    for name, size in sizes.items():
        effect = next(one for one in CATALOGUE if one.label == name)
        constants = {constant.name: constant.grid[0] for constant in effect.constants}
        hypothesis = hypothesis.with_effect(effect, {**constants, effect.amplitudes[0].name: size})
    free = free_parameters(hypothesis)
    columns = RNG.normal(size=(ROWS * CHANNELS, len(free) - 2))
    return replace(
        base,
        hypothesis=hypothesis,
        free_parameters=free,
        predicted=(predicted,),
        jacobian=(np.column_stack([base.jacobian[0], columns]),),
    )


@pytest.mark.parametrize(("correction", "share"), [(CORRECTION, 0.99), (0.0 * CORRECTION, 0.01)])
def test_a_second_cause_is_asked_for_more_than_what_meshes_may_have_left(
    correction: FloatArray, share: float
) -> None:
    case, base = measured_with(2e-7, correction)
    one = Candidate(fitted(base, 0.0 * CHANGE, camera_scale=0.01), 1000.0, np.zeros(3))
    gain = explained(base) - 4.0
    both = fitted(base, CHANGE, camera_scale=0.01, strain_stiffening=0.02)
    left = (base.residual[0] - case.whitenings[0].apply(CHANGE[:, :, None])[:, 0],)
    pair = Candidate(replace(both, residual=left), 1000.0 + gain, np.zeros(4))
    table = ModelTable(bare_context(base, case, ERROR), none=0.0, unknown=-5.0)
    (model,) = table.with_two(one, [pair], unknown_leads=False)
    assert table.asked(model) == pytest.approx(share * gain, abs=0.01 * gain)
