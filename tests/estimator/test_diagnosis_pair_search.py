"""Which pairs of causes are looked at once more."""

import typing

import numpy as np
import pytest
from bare_contexts import bare_context

from estimator.diagnosis.fitting.case import Linearisation
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.search.candidate import Candidate, best_of_labels
from estimator.diagnosis.search.comparison import Comparison
from estimator.diagnosis.search.pair_screening import Start
from estimator.diagnosis.search.pair_search import beside_what_ties, led_on_by, passed_over
from estimator.diagnosis.search.refinements import mistaken_for
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.effects.catalogue import CATALOGUE, OUTSIDERS

MATERIAL = Hypothesis(15e3, 0.45)
NEAR = DiagnosisSettings().search.near


def beside(present: Hypothesis, name: str, size: float) -> Hypothesis:
    """A hypothesis with one effect more, of some size for each amplitude."""
    effect = next(one for one in (*CATALOGUE, *OUTSIDERS) if one.name == name)
    constants = {constant.name: constant.lower for constant in effect.constants}
    return present.with_effect(effect, {**constants, **{one.name: size for one in effect.amplitudes}})


def candidate(hypothesis: Hypothesis, evidence: float) -> Candidate:
    fit = Linearisation(hypothesis, (), (), (), (), typing.cast(typing.Any, None), ())
    return Candidate(fit, evidence, np.zeros(0))


def test_another_form_of_the_leading_cause_is_no_second_leader() -> None:
    sphere = beside(MATERIAL, "inhomogeneity:sphere", 0.2)
    cylinder = beside(MATERIAL, "inhomogeneity:cylinder", 0.2)
    loose = beside(MATERIAL, "anchor_debonding:throughout", 0.25)
    comparison = [candidate(sphere, 90.0), candidate(cylinder, 89.0), candidate(loose, 80.0)]
    assert [one.log_evidence for one in best_of_labels(comparison)] == [90.0, 80.0]


def test_what_either_cause_of_a_pair_may_be_mistaken_for_is_looked_at() -> None:
    context = bare_context()
    turned = beside(MATERIAL, "camera_rotation", 0.01)
    assert not mistaken_for(context, [candidate(turned, 90.0)])
    pair = beside(turned, "thickness_error:about_middle", 0.1)
    assert [one.name for one in mistaken_for(context, [candidate(pair, 90.0)])] == ["unknown:air_pocket"]


def test_a_cause_that_a_pair_has_led_elsewhere_is_refitted_alone_from_there() -> None:
    drawn = beside(MATERIAL, "prestretch:beads_known_after", 1.7e-3)
    lens = beside(MATERIAL, "unknown:lens_distortion_rest_true", 3.0)
    further = beside(MATERIAL, "prestretch:beads_known_after", 3.7e-3)
    pair = beside(further, "unknown:lens_distortion_rest_true", 2.9)
    assert led_on_by(pair, [candidate(drawn, 90.0), candidate(lens, 80.0)], NEAR) == [further]


def test_a_cause_in_another_form_than_it_was_refitted_in_is_refitted_alone() -> None:
    even = beside(MATERIAL, "anchor_compliance:isotropic", 3e-3)
    uneven = beside(MATERIAL, "anchor_compliance:uneven", 3e-3)
    loose = beside(MATERIAL, "anchor_debonding:throughout", 0.25)
    pair = beside(uneven, "anchor_debonding:throughout", 0.25)
    assert led_on_by(pair, [candidate(even, 90.0), candidate(loose, 80.0)], NEAR) == [uneven]


def comparison_of(evidences: dict[float, Hypothesis]) -> Comparison:
    return Comparison(
        bare_context(candidate(MATERIAL, 0.0).fit),
        0,
        (),
        tuple(candidate(one, evidence) for evidence, one in evidences.items()),
        none=0.0,
        unknown=-5.0,
    )


def test_the_second_cause_of_a_pair_that_leaves_something_is_tried_beside_what_ties_with_its_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    grip = beside(MATERIAL, "gripper_compliance:translation", 1e-4)
    reach = beside(MATERIAL, "motion_scale:translation", 0.01)
    scale = beside(MATERIAL, "camera_scale:of_the_motion", 0.01)
    turned = beside(MATERIAL, "camera_rotation", 0.01)
    evidences = {90.0: grip, 88.0: reach, 85.0: scale, 40.0: turned}
    comparison = comparison_of(evidences)
    pairs = [candidate(beside(one, "gravity_sag:beads_hanging", 0.01), 150.0) for one in (grip, reach)]
    for leaves_nothing, expected in (
        (False, [beside(scale, "gravity_sag:beads_hanging", 0.01)]),
        (True, []),
    ):
        monkeypatch.setattr(
            "estimator.diagnosis.search.models.ModelTable.is_whole",
            lambda table, pair, told=leaves_nothing: told,
        )
        assert beside_what_ties(comparison, pairs) == expected


def test_a_second_cause_that_promised_half_of_what_the_best_one_adds_is_tried_too_unless_it_is_linear(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    turned = beside(MATERIAL, "camera_rotation", 0.01)
    stiffening, gain, fibres, aside = (
        beside(turned, name, 0.01)
        for name in (
            "strain_stiffening:yeoh2",
            "force_axis_gain:tx",
            "anisotropy:tension_only",
            "grasp_misplacement:jaws",
        )
    )
    promised = {100.0 + 90.0: stiffening, 100.0 + 80.0: gain, 100.0 + 60.0: fibres, 100.0 + 20.0: aside}
    monkeypatch.setattr(
        "estimator.diagnosis.search.pair_search.promising_seconds",
        lambda *comparison: [Start(evidence, one) for evidence, one in promised.items()],
    )
    pairs = [candidate(stiffening, 100.0 + 88.0)]
    assert passed_over(comparison_of({100.0: turned}), pairs, least=100.0 + 44.0) == [fibres]
