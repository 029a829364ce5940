"""Which hypotheses are refitted further."""

import typing
from dataclasses import replace

import numpy as np
import pytest
from bare_contexts import bare_case, bare_context
from retraction_cases import REFERENCE_BLOCK

from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.model.free_parameters import free_parameters
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.search.candidate import Candidate
from estimator.diagnosis.search.racing import (
    Round,
    finalists,
    first_point,
    may_win,
    not_solved,
    start_nearer,
    worth_a_second_point,
)
from estimator.diagnosis.search.refinements import at_the_place_of, past_kinks
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.effects.catalogue import CATALOGUE
from estimator.effects.effect import Effect
from estimator.errors import SolverError
from estimator.fem.discretisation.block_mesh import Grading
from estimator.forward.meshing import mesh_experiment

MATERIAL = Hypothesis(15e3, 0.45)
SETTINGS = DiagnosisSettings().search
OF_FOUR_LABELS = ("camera_rotation", "motion_direction", "torque_centre", "camera_scale")


def candidate(name: str, evidence: float, **values: float) -> Candidate:
    effect = next(one for one in CATALOGUE if one.name.startswith(name))
    fit = Linearisation(
        MATERIAL.with_effect(effect, values), (), (), (), (), typing.cast(typing.Any, None), ()
    )
    return Candidate(fit, evidence, np.zeros(0))


def reached(*evidence: float, bar: float = 0.0, within: float = 0.15) -> list[float]:
    field = [candidate(name, value) for name, value in zip(OF_FOUR_LABELS, evidence, strict=False)]
    return [one.log_evidence for one in finalists(field, bar, SETTINGS, Round(2, within, 2))]


def test_rivals_near_the_best_go_on_and_those_far_behind_do_not() -> None:
    assert reached(40.0, 33.0, 29.0) == [40.0, 33.0]


def test_where_much_is_explained_more_of_them_count_as_near() -> None:
    assert reached(1000.0, 880.0, 840.0) == [1000.0, 880.0]


def test_in_a_later_round_fewer_of_them_do() -> None:
    assert reached(1000.0, 955.0, 940.0, within=0.05) == [1000.0, 955.0]


def test_at_most_three_go_on() -> None:
    assert reached(40.0, 39.0, 38.0, 37.0) == [40.0, 39.0, 38.0]


def test_nobody_goes_on_who_remains_far_below_the_bar() -> None:
    assert reached(90.0, 85.0, bar=110.0) == []
    assert reached(105.0, 96.0, bar=110.0) == [105.0]


def test_starts_of_one_label_leave_a_place_to_its_rivals() -> None:
    field = [candidate("inhomogeneity", value) for value in (40.0, 39.0, 38.0)]
    chosen = finalists([*field, candidate("camera_rotation", 37.0)], 0.0, SETTINGS)
    assert [one.log_evidence for one in chosen] == [40.0, 39.0, 37.0]


def test_in_the_end_one_form_of_a_label_is_enough() -> None:
    field = [candidate("inhomogeneity", 40.0), candidate("inhomogeneity", 39.0)]
    field.append(candidate("camera_rotation", 38.0))
    chosen = finalists(field, 0.0, SETTINGS, Round(points=5, within=0.05, of_a_label=1))
    assert [one.log_evidence for one in chosen] == [40.0, 38.0]


def goes_on(lacks: float, fell: float, bar: float = 0.0) -> bool:
    best = candidate("camera_rotation", 100.0)
    return may_win(replace(candidate("camera_scale", 100.0 - lacks), fell=fell), best, bar, SETTINGS)


def test_one_that_lacks_more_than_it_still_gains_does_not_go_on() -> None:
    assert goes_on(lacks=10.0, fell=6.0)
    assert not goes_on(lacks=10.0, fell=4.0)


def test_one_next_to_the_best_goes_on_and_so_does_one_that_has_not_been_refitted_yet() -> None:
    assert goes_on(lacks=0.5, fell=0.0)
    assert goes_on(lacks=10.0, fell=np.inf)


def test_the_best_itself_does_not_go_on_where_it_will_not_reach_the_bar() -> None:
    assert not goes_on(lacks=0.0, fell=4.0, bar=110.0)


def test_far_behind_after_a_point_only_what_is_not_linear_has_a_second_one() -> None:
    first = [
        candidate("inhomogeneity:sphere", 1000.0),
        candidate("force_bias", 900.0),
        candidate("anchor_debonding:throughout", 700.0),
        candidate("camera_scale:uniform", 650.0),
        candidate("anchor_debonding:throughout", 500.0),
    ]
    assert [one.log_evidence for one in worth_a_second_point(first, 0.0, SETTINGS)] == [1000.0, 900.0, 700.0]


SYMMETRIC, TENSION_ONLY = "anisotropy", "anisotropy:tension_only"


def fibres(form: str, angle: float, **more: float) -> Candidate:
    return candidate(form, 90.0, fibre_angle=angle, fibre_modulus_over_modulus=0.03, **more)


def tension_only_at_the_place_of(leader: Candidate, other: Candidate) -> list[Hypothesis]:
    """The starts of fibres of tension alone at the place of a leader beside which another form was refitted."""
    starts = at_the_place_of(bare_context(), leader, [leader, other])
    return [start for start in starts if start.effects[0].name == TENSION_ONLY]


def test_another_form_begins_at_the_place_that_the_leader_has_found() -> None:
    leader, elsewhere = fibres(SYMMETRIC, 0.5), fibres(TENSION_ONLY, 1.0, fibre_stiffening=0.7)
    (start,) = tension_only_at_the_place_of(leader, elsewhere)
    assert start.values == fibres(TENSION_ONLY, 0.5, fibre_stiffening=0.1).fit.hypothesis.values


def test_a_form_that_has_been_at_the_leaders_place_does_not_begin_there_again() -> None:
    leader, there = fibres(SYMMETRIC, 0.5), fibres(TENSION_ONLY, 0.52, fibre_stiffening=0.7)
    assert tension_only_at_the_place_of(leader, there) == []


def test_a_constant_that_the_leader_lacks_begins_at_either_end_of_its_grid() -> None:
    leader = candidate("gripper_slip:gradual", 90.0, threshold=3.0, slip_per_force=2e-4)
    creeping = [
        one for one in at_the_place_of(bare_context(), leader, [leader]) if one.effects[0].form == "creeping"
    ]
    assert [one.values[0]["time_constant"] for one in creeping] == [1.0, 5.0]
    assert all(
        (one.values[0]["threshold"], one.values[0]["slip_per_force"]) == (3.0, 2e-4) for one in creeping
    )


def test_of_two_terms_none_begins_where_a_single_one_fits_best() -> None:
    leader = candidate("viscoelasticity:whole_stress", 90.0, relaxation_time_1=13.0, relaxing_share_1=0.4)
    assert [one.effects[0].form for one in at_the_place_of(bare_context(), leader, [leader])] == ["one_term"]


def test_refinements_of_the_leaders_own_form_begin_first() -> None:
    leader = candidate(
        "stress_softening:pseudo_elastic", 90.0, depth=0.2, width_over_modulus=0.3, relative_width=0.1
    )
    begun = [one.effects[0] for one in at_the_place_of(bare_context(), leader, [leader])]
    refining = [one.elaborates == "pseudo_elastic" for one in begun]
    assert any(refining)
    assert refining == sorted(refining, reverse=True)


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda effect: effect.name)
def test_any_form_may_lead(effect: Effect) -> None:
    values = {constant.name: constant.lower for constant in effect.constants}
    amplitudes = {amplitude.name: amplitude.smallest for amplitude in effect.amplitudes}
    leader = candidate(effect.name, 90.0, **values, **amplitudes)
    others = {start.effects[0] for start in at_the_place_of(bare_context(), leader, [leader])}
    assert all(other.label == effect.label and other is not effect for other in others)


def test_a_form_with_an_instant_of_its_own_does_not_begin_at_the_leaders_place() -> None:
    leader = candidate("anchor_debonding:throughout", 90.0, share=0.3, place=0.4)
    assert at_the_place_of(bare_context(), leader, [leader]) == []


def test_forms_whose_amplitudes_mean_something_else_do_not_begin_there() -> None:
    leader = candidate("robot_backlash:rotation_anywhere", 90.0, start=0.3, width=1e-4)
    assert at_the_place_of(bare_context(), leader, [leader]) == []


def test_a_rim_that_came_off_begins_anew_past_its_kinks_with_the_material_that_it_has_found() -> None:
    block = mesh_experiment(REFERENCE_BLOCK, Grading(3e-3, 8e-3, 25e-3, 3, 1))
    case = Case((REFERENCE_BLOCK,), block, (), (), ())
    loose = candidate("anchor_debonding", 40.0, share=0.3, place=0.4)
    again = past_kinks(case, loose)
    assert len(again) == 4
    assert all(one.youngs_modulus == MATERIAL.youngs_modulus for one in again)
    assert all(one.values != loose.fit.hypothesis.values for one in again)
    assert not past_kinks(case, candidate("camera_scale", 40.0, scale_error=0.1))


def test_a_start_that_cannot_be_solved_is_tried_nearer_to_a_solved_neighbour() -> None:
    effect = next(one for one in CATALOGUE if one.name == "camera_scale:uniform")
    start = replace(
        MATERIAL.with_effect(effect, {"scale_error": 0.09}), youngs_modulus=40e3, poisson_ratio=0.49
    )
    nearer = start_nearer(start, MATERIAL, 1 / 3)
    assert nearer.values[0]["scale_error"] == pytest.approx(0.03)
    assert MATERIAL.youngs_modulus < nearer.youngs_modulus < start.youngs_modulus
    assert MATERIAL.poisson_ratio < nearer.poisson_ratio < start.poisson_ratio
    at_once = start_nearer(start, MATERIAL, 1.0)
    assert at_once.values == start.values
    assert at_once.of_material == pytest.approx(start.of_material)


@pytest.mark.parametrize("equilibrium_within", [0.1, 0.02, 0.0])
def test_it_is_not_solved_only_where_nothing_near_the_neighbour_is(equilibrium_within: float) -> None:
    effect = next(one for one in CATALOGUE if one.name == "camera_scale:uniform")
    start = MATERIAL.with_effect(effect, {"scale_error": 0.09})
    near = fitted_at(MATERIAL)
    tried: list[float] = []

    def solve(case: Case, hypothesis: Hypothesis, neighbour: Linearisation | None) -> Linearisation:
        tried.append(hypothesis.values[0]["scale_error"])
        if tried[-1] > equilibrium_within:
            raise SolverError("no equilibrium")
        return fitted_at(hypothesis)

    found = first_point(bare_case(), start, near, solve)
    assert (found is not None) == (min(tried) <= equilibrium_within)
    assert (found is None) == (equilibrium_within == 0.0)
    assert not_solved([start], []) == ("camera_scale",)


def fitted_at(hypothesis: Hypothesis) -> Linearisation:
    """A solved hypothesis of which nothing was measured."""
    free = free_parameters(hypothesis)
    nothing = np.zeros((0, len(free)))
    return Linearisation(hypothesis, free, (), (np.zeros(0),), (nothing,), (), ())
