"""What counts as a gap: an effect's size, its strength, and whether the model's own error could feign it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest
from bare_contexts import bare_case, bare_context, no_error_in
from numpy.typing import NDArray
from retraction_cases import REFERENCE_BLOCK

from estimator.diagnosis.evidence.discrepancy import Discrepancy
from estimator.diagnosis.evidence.lack_of_fit import rough_gap, rough_remainder
from estimator.diagnosis.evidence.marginal_likelihood import first_order_evidence
from estimator.diagnosis.evidence.posterior import probabilities
from estimator.diagnosis.evidence.signatures import Signature
from estimator.diagnosis.fitting.case import Linearisation
from estimator.diagnosis.model.free_parameters import free_parameters
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.search.candidate import Candidate
from estimator.diagnosis.search.comparison import Comparison
from estimator.diagnosis.search.decision import Verdict, reach_verdict, weigh
from estimator.diagnosis.search.models import ModelTable
from estimator.diagnosis.search.pair_screening import Start
from estimator.diagnosis.search.pair_search import Found
from estimator.diagnosis.search.screening import Trial
from estimator.diagnosis.search.second_cause import starts_of_pairs
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.effects.catalogue import CATALOGUE, OUTSIDERS
from estimator.effects.effect import Effect
from estimator.inference.whitening import Whitening

MATERIAL = Hypothesis(1e4, 0.45)
SETTINGS = DiagnosisSettings()


def tried(name: str, amplitude: str, size: float, gain: float) -> Comparison:
    """A comparison in which one effect of some size raises the log evidence over the baseline's, which is zero."""
    effect = next(one for one in (*CATALOGUE, *OUTSIDERS) if one.name == name)
    constants = {constant.name: constant.lower for constant in effect.constants}
    values = {**constants, **{one.name: 0.0 for one in effect.amplitudes}, amplitude: size}
    trial = Trial(Signature(effect, {}, (), ()), gain, MATERIAL.with_effect(effect, values))
    # Without candidates nothing is asked of the measurements.
    return Comparison(bare_context(), 0, (trial,), (), none=0.0, unknown=-5.0)


@pytest.mark.parametrize("promised", [5.0, 400.0, 1e5])
def test_what_could_not_be_solved_is_no_likelier_than_the_best_that_was(promised: float) -> None:
    solved = tried("camera_scale:uniform", "scale_error", 2e-2, 20.0)
    promising = tried("viscoelasticity:one_term", "relaxing_share_1", 0.5, promised)
    both = replace(solved, trials=(*solved.trials, *promising.trials), unsolved=("viscoelasticity",))
    found = weigh(both)
    assert found["viscoelasticity"] == min(promised, 20.0)
    assert found["camera_scale"] == 20.0


def test_a_verdict_never_names_what_could_not_be_solved_and_keeps_its_own_probabilities() -> None:
    promising = tried("viscoelasticity:one_term", "relaxing_share_1", 0.5, 500.0)
    context = bare_context(refitted(MATERIAL, 0.0).fit, WITH_WHITE_NOISE)
    comparison = replace(promising, context=context, unsolved=("viscoelasticity",), unknown=40.0)
    verdict = reach_verdict(comparison, weigh(comparison))
    assert verdict.labels == ("unknown",)
    assert verdict.probability["unknown"] == max(verdict.probability.values())
    assert verdict.probability["viscoelasticity"] > 0.0


@pytest.mark.parametrize("gain", [10.0, 20.0])
def test_a_slight_stretch_of_the_cameras_scale_is_a_gap_where_it_stands_out(gain: float) -> None:
    found = weigh(tried("camera_scale:uniform", "scale_error", 3e-4, gain))
    assert found["camera_scale"] == gain
    assert found["none"] == 0.0


def test_a_slight_stretch_that_does_not_stand_out_keeps_little_of_its_evidence() -> None:
    found = weigh(tried("camera_scale:uniform", "scale_error", 3e-4, 2.0))
    assert found["none"] == 0.0
    assert found["camera_scale"] == pytest.approx(0.8)


def test_a_slight_stretch_that_explains_nothing_is_not_lifted_to_none() -> None:
    assert weigh(tried("camera_scale:uniform", "scale_error", 3e-4, -3.0))["camera_scale"] == -3.0


def test_a_grasp_well_aside_keeps_all_of_it() -> None:
    assert weigh(tried("grasp_misplacement:gripper", "shift_x", 2e-3, 2.0))["grasp_misplacement"] == 2.0


def test_the_more_a_slight_effect_stands_out_the_more_of_its_evidence_it_keeps() -> None:
    gains = [1.0, 3.0, 4.0, 5.0]
    comparisons = [tried("grasp_misplacement:gripper", "shift_x", 5e-5, gain) for gain in gains]
    kept = [
        weigh(comparison)["grasp_misplacement"] / gain
        for comparison, gain in zip(comparisons, gains, strict=True)
    ]
    assert kept[0] < kept[1] < kept[2] < kept[3] == 1.0


@pytest.mark.parametrize("gain", [20.0, 400.0])
def test_one_effect_without_a_label_is_about_as_likely_beforehand_as_one_with(gain: float) -> None:
    comparisons = [tried(one.name, one.amplitudes[0].name, 1.0, -30.0) for one in OUTSIDERS]
    comparisons += [tried("camera_scale:uniform", "scale_error", 2e-2, gain)]
    comparisons += [tried("unknown:camera_creep", "velocity_x", 1e-4, gain)]
    trials = tuple(trial for one in comparisons for trial in one.trials)
    found = probabilities(weigh(replace(comparisons[0], trials=trials)), SETTINGS.evidence)
    assert found["unknown"] / found["camera_scale"] == pytest.approx(1.0, rel=0.6)


def test_an_effect_without_a_label_that_alone_explains_leads_as_unknown() -> None:
    found = weigh(tried("unknown:camera_creep", "velocity_x", 1e-4, 20.0))
    assert found["unknown"] == 20.0
    assert weigh(tried("unknown:camera_creep", "velocity_x", 1e-4, -20.0))["unknown"] == -5.0


def test_noise_leaves_no_rough_remainder_and_a_few_beads_that_stand_aside_do() -> None:
    rng = np.random.default_rng(5)
    noise = [rng.normal(size=4000), rng.normal(size=5000)]
    assert rough_remainder(noise, 1.0, SETTINGS.evidence) == 0.0
    assert rough_remainder([1.02 * one for one in noise], 1.0, SETTINGS.evidence) == 0.0
    aside = [noise[0], np.where(np.arange(5000) % 48 == 7, noise[1] + 4.0, noise[1])]
    # Sixteen for each of the 104 values that stand aside.
    assert rough_remainder(aside, 1.0, SETTINGS.evidence) == pytest.approx(0.5 * 16 * 104, rel=0.2)


def test_understated_noise_is_no_gap_and_one_experiment_that_stands_aside_is() -> None:
    rng = np.random.default_rng(6)
    noise = [rng.normal(size=3000) for _ in range(3)]
    assert rough_gap([1.15 * one for one in noise], 1.0, SETTINGS.evidence) == 0.0
    beads = np.arange(3000) % 48 < 12
    aside = [*noise[:2], np.where(beads, noise[2] + 1.8 * rng.normal(size=3000), noise[2])]
    remainder = rough_remainder(aside, 1.0, SETTINGS.evidence)
    assert rough_gap(aside, 1.0, SETTINGS.evidence) == remainder > 0.0


VALUES = 1200
WHITE_NOISE = Whitening(
    np.ones((VALUES // 12, 12), dtype=bool),
    np.ones(12),
    np.zeros(12),
    np.zeros((VALUES, 0)),
    np.zeros(0),
)
WITH_WHITE_NOISE = bare_case(whitenings=(WHITE_NOISE,))


def test_causes_that_leave_what_is_smooth_are_not_the_whole_story_however_little_it_is() -> None:
    rng = np.random.default_rng(11)
    noise = rng.normal(size=VALUES)
    smooth, by_modulus = np.split(np.linalg.qr(rng.normal(size=(VALUES, 12)))[0], [10], axis=1)
    process = Discrepancy((smooth, np.zeros((VALUES, 0))), (np.ones(10), np.zeros(0)))
    error = no_error_in(process)
    case = replace(WITH_WHITE_NOISE, experiments=(REFERENCE_BLOCK,))
    nothing_moves = np.zeros((VALUES // 12, 12))

    def leaves_noise_alone(residual: NDArray[np.float64]) -> bool:
        fit = Linearisation(
            MATERIAL, free_parameters(MATERIAL), (nothing_moves,), (residual,), (by_modulus,), (), ()
        )
        candidate = Candidate(fit, first_order_evidence(case, fit, error), np.zeros(2))
        return ModelTable(bare_context(fit, case, error), 0.0, 0.0).is_whole(candidate)

    # The sum of squares cannot tell: within 3 of its deviations that of noise alone differs by 150.
    assert leaves_noise_alone(noise)
    assert not leaves_noise_alone(noise + smooth @ np.full(10, np.sqrt(60.0 / 10)))
    assert leaves_noise_alone(1.05 * noise)


CUT, POCKET, REGION, LOST_GRIP, CAMERA = (
    next(one for one in (*CATALOGUE, *OUTSIDERS) if one.name == name)
    for name in (
        "unknown:cut",
        "unknown:air_pocket",
        "inhomogeneity:cylinder",
        "gripper_compliance:translation",
        "camera_scale:uniform",
    )
)


def present(*effects: Effect) -> Hypothesis:
    found = MATERIAL
    for effect in effects:
        constants = {constant.name: constant.lower for constant in effect.constants}
        found = found.with_effect(effect, {**constants, **{one.name: 0.9 for one in effect.amplitudes}})
    return found


def refitted(hypothesis: Hypothesis, evidence: float) -> Candidate:
    fit = Linearisation(hypothesis, (), (), (np.zeros(30),), (np.zeros((30, 0)),), (), ())
    return Candidate(fit, evidence, np.zeros(0))


def verdict_of(
    alone: Sequence[Candidate],
    pairs: Sequence[Candidate],
    monkeypatch: pytest.MonkeyPatch,
    mistaken: Sequence[Candidate] = (),
    unknown: float = -5.0,
    beyond_noise: float = 0.0,
) -> tuple[Verdict, Mapping[str, float]]:
    """The verdict on refitted single causes and pairs, and the evidence of the single ones.

    ``mistaken`` is what proves to be mistaken for one of a pair's causes, ``unknown`` the log evidence of something
    unknown, and ``beyond_noise`` what every pair leaves.
    """
    comparison = replace(
        tried("unknown:cut", "log_softness", 0.9, 643.0),
        context=bare_context(refitted(MATERIAL, 0.0).fit, WITH_WHITE_NOISE),
        trials=(),
        candidates=tuple(alone),
        unknown=unknown,
    )
    monkeypatch.setattr(
        "estimator.diagnosis.search.decision.search_pairs",
        lambda comparison, best, *rest: Found(best, tuple(pairs)),
    )
    monkeypatch.setattr(
        "estimator.diagnosis.search.decision.with_what_it_is_mistaken_for",
        lambda comparison, *rest: replace(comparison, candidates=(*mistaken, *comparison.candidates)),
    )
    table = "estimator.diagnosis.search.models.ModelTable"
    monkeypatch.setattr(f"{table}.is_whole", lambda table, pair: not beyond_noise)
    monkeypatch.setattr(f"{table}.beyond_noise", lambda table, pair: beyond_noise)
    monkeypatch.setattr(f"{table}.smooth_remainder", lambda table, one: -np.inf)
    evidence = weigh(comparison)
    return reach_verdict(comparison, evidence), evidence


def test_of_two_causes_the_more_probable_leads_though_another_has_more_evidence(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    alone = [refitted(present(CUT), 643.0), refitted(present(REGION), 646.0)]
    verdict, evidence = verdict_of(alone, [refitted(present(REGION, CUT), 700.0)], monkeypatch)
    assert evidence["inhomogeneity"] > evidence["unknown"]
    assert verdict.labels == ("unknown", "inhomogeneity")
    assert next(iter(verdict.probability)) == "unknown"


def test_a_rival_is_weighed_with_a_second_cause_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    alone = [refitted(present(REGION), 646.0), refitted(present(CUT), 643.0)]
    best = refitted(present(REGION, LOST_GRIP), 700.0)
    by_itself, _ = verdict_of(alone, [best], monkeypatch)
    beside_it, _ = verdict_of(alone, [best, refitted(present(CUT, LOST_GRIP), 699.0)], monkeypatch)
    assert by_itself.labels == ("inhomogeneity", "gripper_compliance")
    assert by_itself.probability["inhomogeneity"] > 0.9
    assert beside_it.probability["unknown"] > 0.5
    assert beside_it.labels == ("unknown", "gripper_compliance")


def test_a_rival_with_a_second_cause_pays_for_the_choice_among_its_forms(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    alone = [refitted(present(REGION), 646.0), refitted(present(CUT), 643.0)]
    pairs = [
        refitted(present(REGION, LOST_GRIP), 700.0),
        refitted(present(CUT, LOST_GRIP), 699.0),
    ]
    of_one, _ = verdict_of(alone, pairs, monkeypatch)
    of_two, _ = verdict_of([*alone, refitted(present(POCKET), 10.0)], pairs, monkeypatch)

    def odds(verdict: Verdict) -> float:
        return verdict.probability["unknown"] / verdict.probability["inhomogeneity"]

    assert odds(of_two) == pytest.approx(odds(of_one) / 2.0)


def test_a_second_cause_that_adds_too_little_to_be_named_is_doubted(monkeypatch: pytest.MonkeyPatch) -> None:
    alone = [refitted(present(LOST_GRIP), 646.0)]

    def verdict_beside(added: float) -> Verdict:
        pair = refitted(present(LOST_GRIP, CAMERA), 646.0 + added)
        return verdict_of(alone, [pair], monkeypatch)[0]

    (doubt,) = verdict_beside(5.0).doubted
    assert verdict_beside(5.0).labels == ("gripper_compliance",)
    assert (doubt.label, doubt.adds) == ("camera_scale", pytest.approx(5.0))
    assert doubt.asked > doubt.adds
    assert not verdict_beside(1.0).doubted
    assert verdict_beside(20.0).labels == ("gripper_compliance", "camera_scale")
    assert not verdict_beside(20.0).doubted


@pytest.mark.parametrize(("gain", "named"), [(4.5, ()), (9.0, ("gripper_compliance",))])
def test_a_cause_more_probable_than_none_is_not_named_where_none_remains_likely(
    gain: float, named: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    verdict, _ = verdict_of([refitted(present(LOST_GRIP), gain)], [], monkeypatch)
    assert verdict.labels == named
    assert (verdict.winner is None) == (not named)
    assert verdict.probability["gripper_compliance"] > verdict.probability["none"]


def test_two_causes_are_named_though_neither_alone_would_be(monkeypatch: pytest.MonkeyPatch) -> None:
    alone = [refitted(present(LOST_GRIP), 4.5), refitted(present(CAMERA), 1.0)]
    verdict, _ = verdict_of(alone, [refitted(present(LOST_GRIP, CAMERA), 30.0)], monkeypatch)
    assert verdict.labels == ("gripper_compliance", "camera_scale")


def begun_pairs(
    leaders: Sequence[Candidate],
    monkeypatch: pytest.MonkeyPatch,
    beside: Mapping[str, Sequence[Start]],
    together: Sequence[Start] = (),
    leaves_noise_alone: bool = False,
    beyond_noise: float = 500.0,
) -> list[Hypothesis]:
    """The pairs whose refits begin beside single causes, the most probable first, which explain 0 without any.

    ``beside`` is what first order promises beside each label, ``together`` of pairs weighed together; the last two tell
    what the leaders leave.
    """
    for name, told in (
        ("second_cause.promising_seconds", lambda table, leader, *rest: list(beside[leader.labels[0]])),
        ("second_cause.likeliest_pairs", lambda *of_trials: list(together)),
        ("models.ModelTable.is_whole", lambda *of_leader: leaves_noise_alone),
        ("models.ModelTable.beyond_noise", lambda *of_leader: beyond_noise),
    ):
        monkeypatch.setattr(f"estimator.diagnosis.search.{name}", told)
    comparison = tried("unknown:cut", "log_softness", 0.9, 643.0)
    return starts_of_pairs(comparison.table, leaders, comparison.trials)


def test_the_best_second_cause_beside_the_first_leader_is_refitted_whatever_a_leader_far_behind_promises(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    first, behind = refitted(present(LOST_GRIP), 700.0), refitted(present(REGION), 300.0)
    surest, boldest = Start(720.0, present(LOST_GRIP, CAMERA)), Start(900.0, present(REGION, LOST_GRIP))
    promised = {LOST_GRIP.label: [surest], REGION.label: [boldest]}
    starts = begun_pairs([first, behind], monkeypatch, promised)
    assert starts == [surest.hypothesis, boldest.hypothesis]


@pytest.mark.parametrize("leaves_noise_alone", [True, False])
def test_beside_a_leader_that_leaves_noise_alone_and_promises_nothing_no_pair_is_refitted(
    leaves_noise_alone: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, behind = refitted(present(LOST_GRIP), 700.0), refitted(present(REGION), 300.0)
    boldest = Start(900.0, present(REGION, CAMERA))
    promised: dict[str, list[Start]] = {LOST_GRIP.label: [], REGION.label: [boldest]}
    starts = begun_pairs([first, behind], monkeypatch, promised, leaves_noise_alone=leaves_noise_alone)
    assert starts == ([] if leaves_noise_alone else [boldest.hypothesis])


@pytest.mark.parametrize(("promised", "is_begun"), [(690.0, True), (500.0, False)])
def test_two_causes_that_promise_far_less_than_the_best_single_one_are_not_refitted(
    promised: float, is_begun: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    leader = refitted(present(LOST_GRIP), 700.0)
    both = Start(promised, present(REGION, CAMERA))
    starts = begun_pairs([leader], monkeypatch, {LOST_GRIP.label: []}, together=[both])
    assert starts == ([both.hypothesis] if is_begun else [])


@pytest.mark.parametrize(("promised", "is_begun"), [(3_500.0, True), (3_000.0, False)])
def test_a_second_cause_that_would_leave_more_than_it_explains_is_not_refitted(
    promised: float, is_begun: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Beside a leader that leaves 10 000 in log density; a refit may double what is promised.
    leader, second = refitted(present(LOST_GRIP), 1_000.0), Start(promised, present(LOST_GRIP, REGION))
    starts = begun_pairs([leader], monkeypatch, {LOST_GRIP.label: [second]}, beyond_noise=20_000.0)
    assert starts == ([second.hypothesis] if is_begun else [])


def test_what_two_causes_are_mistaken_for_takes_their_place_where_it_explains_as_much_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    alone, pair = [refitted(present(LOST_GRIP), 646.0)], refitted(present(LOST_GRIP, REGION), 700.0)
    two, _ = verdict_of(alone, [pair], monkeypatch)
    assert two.labels == ("gripper_compliance", "inhomogeneity")
    cut = refitted(present(CUT), 720.0)
    one, _ = verdict_of(alone, [pair], monkeypatch, mistaken=[cut])
    assert one.labels == ("unknown",)
    assert one.winner is cut


def test_two_causes_where_the_unknown_leads_leave_less_beyond_noise_than_they_explain_beyond_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    alone, pair = [refitted(present(LOST_GRIP), 646.0)], refitted(present(LOST_GRIP, REGION), 900.0)

    def labels(beyond_noise: float) -> tuple[str, ...]:
        return verdict_of(alone, [pair], monkeypatch, unknown=700.0, beyond_noise=beyond_noise)[0].labels

    assert labels(beyond_noise=380.0) == ("gripper_compliance", "inhomogeneity")
    assert labels(beyond_noise=420.0) == ("unknown",)


def test_a_second_cause_that_leaves_more_than_it_explains_and_than_rows_share_is_not_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    alone, pair = [refitted(present(LOST_GRIP), 646.0)], refitted(present(LOST_GRIP, REGION), 900.0)

    def labels(beyond_noise: float) -> tuple[str, ...]:
        return verdict_of(alone, [pair], monkeypatch, beyond_noise=beyond_noise)[0].labels

    assert labels(beyond_noise=2 * (254.0 + 900.0)) == ("gripper_compliance", "inhomogeneity")
    assert labels(beyond_noise=2 * (254.0 + 1100.0)) == ("gripper_compliance",)
