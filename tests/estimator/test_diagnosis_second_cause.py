"""What a second cause beside a first one must promise to be looked for, and what asks for a finer form of the first."""

import typing
from dataclasses import replace

import numpy as np
import pytest
from bare_contexts import bare_case, bare_context, no_error_in
from retraction_cases import REFERENCE_BLOCK

from estimator.diagnosis.evidence.discrepancy import Discrepancy
from estimator.diagnosis.evidence.signatures import Signature
from estimator.diagnosis.fitting.case import Linearisation
from estimator.diagnosis.model.free_parameters import free_parameters
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.search.candidate import Candidate
from estimator.diagnosis.search.context import Context
from estimator.diagnosis.search.models import ModelTable
from estimator.diagnosis.search.screening import Trial
from estimator.diagnosis.search.second_cause import asks_for_a_finer_form, promising_seconds
from estimator.effects.catalogue import CATALOGUE, OUTSIDERS

MATERIAL = Hypothesis(1e4, 0.45)


class Beside(typing.NamedTuple):
    """A refitted first cause, and a second one that would raise the log evidence beside it."""

    context: Context
    leader: Candidate
    trial: Trial


def leaves(left: float, first: str, second: str, explained: float = 100.0) -> Beside:
    """A first cause that explains so much, and what it leaves for a second one of one amplitude."""
    leader, other = (
        next(one for one in (*CATALOGUE, *OUTSIDERS) if one.name == name) for name in (first, second)
    )
    null = MATERIAL.with_effect(other, {amplitude.name: 0.0 for amplitude in other.amplitudes})
    free = free_parameters(null)
    columns = np.linalg.qr(np.random.default_rng(3).normal(size=(400, 3)))[0]
    scale = free[2].prior_scale
    # The usual size of the second cause is a hundred times what the measurements resolve: that alone would cost 4.6.
    along = columns[:, 2] * 100.0 / scale
    residual = np.sqrt(2.0 * (left + np.log(100.0))) * columns[:, 2]
    nothing = np.zeros((400, 1))
    error = no_error_in(Discrepancy((nothing, nothing), (np.zeros(1), np.zeros(1))))
    leading = MATERIAL.with_effect(leader, {amplitude.name: 1e-4 for amplitude in leader.amplitudes})
    fit = Linearisation(leading, free[:2], (), (residual,), (columns[:, :2],), (), ())
    trial = Trial(Signature(other, {}, free[2:], (along[:, None],)), 0.0, null)
    context = bare_context(fit, bare_case((REFERENCE_BLOCK,)), error)
    return Beside(context, Candidate(fit, explained, np.zeros(2)), trial)


def found_beside(explained: float, left: float, first: str = "gripper_compliance:translation") -> bool:
    """Whether a second cause is looked for that would raise the log evidence by about ``left`` beside a first one."""
    context, leader, trial = leaves(left, first, "camera_scale:uniform", explained)
    return bool(promising_seconds(ModelTable(context, 0.0, 0.0), leader, [trial]))


def test_what_a_nearly_right_form_leaves_of_a_large_gap_is_no_second_cause() -> None:
    assert found_beside(explained=100.0, left=50.0)
    assert not found_beside(explained=1e6, left=50.0)
    assert found_beside(explained=1e6, left=3000.0)
    assert not found_beside(explained=100.0, left=1.0)


def test_what_two_causes_would_not_be_believed_for_is_not_refitted() -> None:
    assert not found_beside(explained=100.0, left=1.2)
    assert found_beside(explained=100.0, left=5.0)


def test_beside_two_beads_that_are_exchanged_nothing_is_their_inexactness() -> None:
    exchange = "fiducial_mislabel:to_the_last_experiment"
    assert found_beside(explained=1e6, left=50.0, first=exchange)
    assert not found_beside(explained=1e6, left=1.0, first=exchange)


def test_a_constant_linear_change_of_readings_leaves_less_for_a_second_cause_than_a_law_of_the_tissue() -> (
    None
):
    assert found_beside(explained=2e4, left=18.0, first="force_axis_gain:fx")
    assert not found_beside(explained=2e4, left=18.0, first="strain_stiffening:gent")


def test_what_another_effect_of_its_own_kind_would_explain_asks_for_a_finer_form_of_the_leader() -> None:
    for left, expected in ((0.0, False), (30.0, True)):
        context, leader, trial = leaves(left, "camera_scale:uniform", "camera_scale:of_the_motion")
        assert asks_for_a_finer_form(context, leader, [trial]) == expected
    context, leader, trial = leaves(30.0, "gripper_compliance:translation", "camera_scale:of_the_motion")
    assert not asks_for_a_finer_form(context, leader, [trial])


@pytest.mark.parametrize(
    ("first", "expected"), [("camera_scale:uniform", True), ("gripper_compliance:translation", False)]
)
def test_what_another_form_of_a_cause_would_explain_is_asked_of_a_second_one_beside(
    first: str, expected: bool
) -> None:
    context, leader, trial = leaves(30.0, first, "camera_scale:of_the_motion")
    # The baseline left ten thousand: a twentieth of that is more than what the leader leaves.
    before = replace(leader.fit, residual=(np.sqrt(1e4 / 400) * np.ones(400),))
    known = ModelTable(context.beside(before), 0.0, 0.0, (trial.signature,))
    without = ModelTable(context.beside(before), 0.0, 0.0)
    labels = (*leader.labels, "gripper_slip")
    more = known.asked_of_two(leader, labels) - without.asked_of_two(leader, labels)
    assert (more > 20.0) == expected
    assert expected or more == 0.0


def test_what_leaves_noise_alone_leaves_nothing_to_its_other_forms() -> None:
    context, leader, trial = leaves(0.0, "camera_scale:uniform", "camera_scale:of_the_motion")
    before = replace(leader.fit, residual=(np.sqrt(1e4 / 400) * np.ones(400),))
    table = ModelTable(context.beside(before), 0.0, 0.0, (trial.signature,))
    assert table.of_family(leader) < 3.0


def test_beside_what_is_recognised_outside_the_catalogue_a_cause_must_add_a_share_of_what_that_does() -> None:
    swelling = "unknown:shrinkage"
    assert not found_beside(explained=2000.0, left=60.0, first=swelling)
    assert found_beside(explained=2000.0, left=60.0)
    assert found_beside(explained=2000.0, left=200.0, first=swelling)
