"""The table of models: what two causes, or something unknown beside them, must explain to be believed."""

import math
from dataclasses import replace

import numpy as np
import pytest
from bare_contexts import bare_case, bare_context

from estimator.diagnosis.fitting.case import Linearisation
from estimator.diagnosis.model.free_parameters import free_parameters
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.search.candidate import Candidate
from estimator.diagnosis.search.models import ModelTable
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.effects.catalogue import CATALOGUE, LABELS, OUTSIDERS
from estimator.inference.whitening import Whitening

SETTINGS = DiagnosisSettings()
EFFECTS = {effect.name: effect for effect in (*CATALOGUE, *OUTSIDERS)}
GRIP, CAMERA, CUT = "gripper_compliance:translation", "camera_scale:uniform", "unknown:cut"
WHITE = Whitening(np.ones((5, 6), dtype=bool), np.ones(6), np.zeros(6), np.zeros((30, 0)), np.zeros(0))


def refitted(*names: str, evidence: float) -> Candidate:
    found = Hypothesis(1e4, 0.45)
    for name in names:
        effect = EFFECTS[name]
        constants = {constant.name: constant.lower for constant in effect.constants}
        found = found.with_effect(effect, {**constants, **{one.name: 0.9 for one in effect.amplitudes}})
    fit = Linearisation(found, (), (), (np.zeros(30),), (np.zeros((30, 0)),), (), ())
    return Candidate(fit, evidence, np.zeros(0))


def table(unknown: float = -5.0) -> ModelTable:
    """A table of models that leave nothing, of a case without a cause of evidence zero."""
    return ModelTable(bare_context(refitted(evidence=0.0).fit, bare_case((), (WHITE,))), 0.0, unknown)


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> dict[str, float]:
    """What something unknown beside any model explains, and what that leaves beyond noise; by their names."""
    left = {"smooth_remainder": -1.0, "beyond_noise": 0.0}
    for name in left:
        monkeypatch.setattr(ModelTable, name, lambda table, one, told=name: left[told])
    return left


def test_a_second_cause_pays_for_its_prior_and_its_choice(told: dict[str, float]) -> None:
    one, pair = refitted(GRIP, evidence=100.0), refitted(GRIP, CAMERA, evidence=200.0)
    alone, (both,) = table().with_one(one), table().with_two(one, [pair], unknown_leads=False)
    inexact = EFFECTS[GRIP].inexactness * 100.0
    paid = math.log(len(LABELS)) - math.log(SETTINGS.evidence.prior_of_a_pair) + inexact
    assert alone.log_prior - both.log_prior == pytest.approx(paid)
    assert (both.log_evidence, both.verdict) == (200.0, "believed")


def test_two_causes_without_the_best_one_pay_for_the_choice_of_both(told: dict[str, float]) -> None:
    one = refitted(GRIP, evidence=100.0)
    with_it, without = table().with_two(
        one,
        [
            refitted(GRIP, CAMERA, evidence=200.0),
            refitted(CAMERA, "camera_rotation:of_positions", evidence=200.0),
        ],
        unknown_leads=False,
    )
    assert with_it.log_prior - without.log_prior == pytest.approx(math.log(len(LABELS)))


@pytest.mark.parametrize("gain", [1.0, 5.0, 6.0, 40.0])
def test_two_causes_are_believed_from_what_they_are_asked_on(gain: float, told: dict[str, float]) -> None:
    one = refitted(GRIP, evidence=100.0)
    alone = table().with_one(one)
    (both,) = table().with_two(one, [refitted(GRIP, CAMERA, evidence=100.0 + gain)], unknown_leads=False)
    more_probable = both.log_prior + both.log_evidence > alone.log_prior + alone.log_evidence
    assert (both.verdict == "believed") == more_probable == both.explains_more


@pytest.mark.parametrize(("beyond_noise", "verdict"), [(0.0, "believed"), (1e5, "leaves too much")])
def test_two_causes_that_leave_more_than_they_explain_are_not_believed(
    beyond_noise: float, verdict: str, told: dict[str, float]
) -> None:
    told.update(smooth_remainder=50.0, beyond_noise=beyond_noise)
    one, pair = refitted(GRIP, evidence=100.0), refitted(GRIP, CAMERA, evidence=200.0)
    (both,) = table().with_two(one, [pair], unknown_leads=False)
    assert (both.verdict, both.explains_more) == (verdict, True)


@pytest.mark.parametrize(
    ("none", "first", "both", "verdict"),
    [
        (40.0, 20.0, 10.0, "believed"),
        (40.0, 20.0, 21.0, "foretells worse"),  # better than no cause, yet worse than the first alone
        (20.0, 40.0, 21.0, "foretells worse"),  # better than the first alone, yet worse than no cause
    ],
)
def test_two_causes_foretell_what_is_left_out_no_worse_than_one_or_none(
    none: float, first: float, both: float, verdict: str, told: dict[str, float]
) -> None:
    def seen_twice(one: Candidate, misfit: float) -> Candidate:
        of_material, aside = np.eye(30)[:, :2], misfit * np.eye(30)[:, 2]
        fit = replace(
            one.fit,
            free_parameters=free_parameters(Hypothesis(1e4, 0.45)),
            residual=(aside, aside),
            jacobian=(of_material, of_material),
        )
        return replace(one, fit=fit)

    baseline = seen_twice(refitted(evidence=0.0), none)
    one, pair = refitted(GRIP, evidence=100.0), refitted(GRIP, CAMERA, evidence=200.0)
    context = bare_context(baseline.fit, bare_case((), (WHITE, WHITE)))
    (model,) = ModelTable(context, 0.0, -5.0).with_two(
        seen_twice(one, first), [seen_twice(pair, both)], unknown_leads=False
    )
    assert model.verdict == verdict


def test_two_causes_that_something_unknown_comes_near_are_not_believed(told: dict[str, float]) -> None:
    one, pair = refitted(GRIP, evidence=100.0), refitted(GRIP, CAMERA, evidence=200.0)
    (both,) = table(unknown=190.0).with_two(one, [pair], unknown_leads=False)
    assert both.verdict == "leaves too much"


@pytest.mark.parametrize("causes", [(GRIP,), (GRIP, CAMERA)])
@pytest.mark.parametrize("explained", [20.0, 2000.0])
def test_something_unknown_beside_causes_must_gain_a_share_of_what_these_explain(
    causes: tuple[str, ...], explained: float, told: dict[str, float]
) -> None:
    held = refitted(*causes, evidence=explained)
    alone = table().with_one(held)
    asked = max(SETTINGS.search.decisive, SETTINGS.search.remainder * explained)
    for gain, verdict in ((0.9 * asked, "explains too little"), (1.1 * asked, "believed")):
        told["smooth_remainder"] = gain
        beside = table().beside(alone, held)
        assert beside.unknown
        assert beside.verdict == verdict
        assert alone.log_prior - beside.log_prior == pytest.approx(asked)
        assert beside.log_evidence - alone.log_evidence == pytest.approx(gain)


def test_without_a_cause_single_readings_that_stand_aside_speak_for_something_unknown() -> None:
    for rough, verdicts in (
        (0.0, ["believed", "explains too little"]),
        (9.0, ["leaves too much", "believed"]),
    ):
        none, unknown = table().without_cause(rough)
        assert [none.verdict, unknown.verdict] == verdicts
        assert none.log_prior == pytest.approx(math.log(SETTINGS.evidence.prior_of_none))
        assert unknown.log_evidence == max(-5.0, rough)


def test_what_is_recognised_outside_the_catalogue_asks_more_of_a_cause_beside_it(
    told: dict[str, float],
) -> None:
    one = refitted(CUT, evidence=2000.0)
    gains = (60.0, 200.0)
    models = table().with_two(
        one, [refitted(CUT, CAMERA, evidence=2000.0 + gain) for gain in gains], unknown_leads=True
    )
    assert [model.verdict for model in models] == ["explains too little", "believed"]
