"""Derivatives of every effect at its null, against the case solved anew with a little of the effect."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from retraction_cases import REFERENCE_BLOCK, straight_pull, turning_pull, with_rows
from scipy.spatial.transform import Rotation

from estimator.diagnosis.model.free_parameters import free_parameters
from estimator.diagnosis.model.grip_load import GripLoad
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.setup import Setup
from estimator.diagnosis.model.solution import Mechanics, mechanics_of, solve_case
from estimator.diagnosis.sensitivity.perturbation import Perturbation
from estimator.diagnosis.sensitivity.readings import channels, derivatives, predicted_readings
from estimator.diagnosis.settings import DiagnosisSettings, SolverSettings
from estimator.effects.catalogue import CATALOGUE, OUTSIDERS
from estimator.effects.effect import Effect
from estimator.experiment import Experiment
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.equilibrium.morph import with_beads_at
from estimator.forward.meshing import mesh_experiment

FloatArray = NDArray[np.float64]
TINY = Grading(grasp_m=20e-3, anchor_m=30e-3, largest_m=40e-3, growth=4.0, layers=1)
# For what differs within an element.
SMALLER = Grading(grasp_m=6e-3, anchor_m=10e-3, largest_m=30e-3, growth=3.0, layers=1)
DIFFERING_WITHIN = (
    "inhomogeneity:cylinder",
    "modulus_gradient:in_plane",
    "modulus_gradient:curved_in_plane",
    "unknown:cut",
)
BASE = Hypothesis(12e3, 0.42)
# Of a usual size, for the reference; where nodes lift off a bed as it grows a smaller one is nearer to the null.
SHARE, SHARE_ON_A_BED = 0.02, 0.005
ON_A_BED = ("gravity_sag:on_soft_bed", "gravity_sag:on_soft_bed_beads_lying")
ROWS = 6  # of each retraction
ZEROS = [np.zeros((ROWS, 6 + 48))] * 2
DEVIATION = np.concatenate([[0.02] * 3, [5e-4] * 3, [5e-5] * 48])
TOLERANCE = 0.01
# A few integration points across their rims are what limits these.
WITH_A_RIM, TOLERANCE_AT_A_RIM = ("inhomogeneity:cylinder", "unknown:cut"), 0.03


def _there_and_back(poses: Sequence[GripperPose]) -> list[GripperPose]:
    rest = GripperPose(np.array(REFERENCE_BLOCK.grasp.centre), Rotation.identity())
    return [rest, *poses, poses[-1], *poses[-2::-1], rest]


def _planned(grading: Grading) -> list[Experiment]:
    """Two short retractions, out with a hold and back, each as its sensors would see the baseline."""
    paths = (
        straight_pull(REFERENCE_BLOCK, 0.012, 2),
        turning_pull(REFERENCE_BLOCK, 0.012, np.radians([25.0, 0.0, 15.0]), 2),
    )
    found = []
    for order, path in enumerate(paths, start=1):
        poses = _there_and_back(path)
        blank = with_rows(REFERENCE_BLOCK, poses, np.zeros((ROWS, 6)), np.zeros((ROWS, 16, 3)))
        phase = ("hold", "ramp", "ramp", "hold", "return", "return")
        spaced = replace(blank, order=order, time=5.0 * blank.time, phase=phase)
        found.append(_seen(spaced, grading))
    return found


def _seen(planned: Experiment, grading: Grading) -> Experiment:
    problem = mesh_experiment(planned, grading)
    one = mechanics_of(solve_case(Setup([planned], problem, [GripLoad.none(len(planned.time))]), BASE)[0])
    rows = one.solution.load_steps.of_row
    return replace(planned, wrench=one.wrench[rows], fiducials=one.fiducials[rows])


@cache
def case(grading: Grading = TINY) -> Setup:
    """The two retractions and the loads that they were felt with, once for all tests of a process that need them."""
    experiments = _planned(grading)
    loads = [GripLoad(each.wrench, each.wrench / BASE.youngs_modulus) for each in experiments]
    return Setup(experiments, mesh_experiment(experiments[0], grading), loads)


def solved(hypothesis: Hypothesis, grading: Grading = TINY) -> list[Mechanics]:
    """With the tangents of the equilibria themselves: a diagnosis makes do with those from shortly before them."""
    exact = DiagnosisSettings(solver=SolverSettings(tangent_reuse=0.0))
    return [mechanics_of(one) for one in solve_case(replace(case(grading), settings=exact), hypothesis)]


def read(mechanics: Sequence[Mechanics], hypothesis: Hypothesis) -> FloatArray:
    """All channels in units of the sensors' noise."""
    rows = [
        channels(predicted_readings(one, hypothesis, zero))
        for one, zero in zip(mechanics, ZEROS[: len(mechanics)], strict=True)
    ]
    return np.concatenate(rows) / DEVIATION


@cache
def baseline(grading: Grading = TINY) -> list[Mechanics]:
    return solved(BASE, grading)


def named(name: str) -> Effect:
    return next(one for one in CATALOGUE if one.name == name)


def present(effect: Effect, constants: dict[str, float]) -> Hypothesis:
    return BASE.with_effect(effect, {**constants, **{a.name: 0.0 for a in effect.amplitudes}})


def one_form_of_each_label() -> list[Effect]:
    """And some of which the term or the law is another, or that move the beads to other tissue as they grow."""
    more = (
        "thickness_error:uneven",
        "modulus_gradient:curved_in_plane",
        "grasp_misplacement:edges",
        "gravity_sag:beads_hanging",
        "gravity_sag:on_soft_bed",
        "gravity_sag:on_soft_bed_beads_lying",
        "prestretch:shrunk_in_place",
        "viscoelasticity:spectrum",
        "anisotropy:two_families",
        "support_friction:viscous",
        "strain_stiffening:knowles",
        "strain_stiffening:ogden1",
    )
    found: dict[str, Effect] = {}
    for effect in CATALOGUE:
        if not effect.needs_platens:  # of a block between plates: test_platen_friction.py
            found.setdefault(effect.label, effect)
    return [
        *found.values(),
        *(one for one in CATALOGUE if one.name in more),
        *OUTSIDERS,
    ]


def error_at_null(effect: Effect, constants: dict[str, float], grading: Grading = TINY) -> float:
    """By how much the derivative by the last amplitude, with these constants, is off, as a share of it."""
    null = present(effect, constants)
    names = {amplitude.name for amplitude in effect.amplitudes}
    free = [c for c in free_parameters(null) if c.effect == 0 and c.key in names]
    # The last: turning about the pull, the first of a direction's angles, changes nothing.
    coordinate = free[-1]
    perturbation = Perturbation(
        coordinate.name, coordinate.put(null, coordinate.step), effect, coordinate.step
    )
    predicted = np.concatenate(
        [block[:, :, 0] for block in derivatives(baseline(grading), null, [perturbation], ZEROS)]
    )
    size = (SHARE_ON_A_BED if effect.name in ON_A_BED else SHARE) * coordinate.prior_scale
    slopes = []
    for amplitude in (size, size / 2):
        hypothesis = coordinate.put(null, amplitude)
        seen = read(solved(hypothesis, grading), hypothesis)
        slopes.append((seen - read(baseline(grading), BASE)) / amplitude)
    resolved = 2 * slopes[1] - slopes[0]
    assert np.linalg.norm(resolved) > 0
    return float(np.linalg.norm(predicted / DEVIATION - resolved) / np.linalg.norm(resolved))


@pytest.mark.parametrize("effect", one_form_of_each_label(), ids=lambda effect: effect.name)
def test_the_derivative_at_the_null_is_that_of_the_solved_case(effect: Effect) -> None:
    grading = SMALLER if effect.name in DIFFERING_WITHIN else TINY
    solutions = baseline(grading)
    readings = [predicted_readings(one, BASE, zero) for one, zero in zip(solutions, ZEROS, strict=True)]
    starts = effect.starts(readings)
    tolerance = TOLERANCE_AT_A_RIM if effect.name in WITH_A_RIM else TOLERANCE
    assert error_at_null(effect, starts[len(starts) // 2], grading) < tolerance


def test_what_slides_on_while_the_gripper_holds_is_in_the_derivative() -> None:
    creeping = named("gripper_slip:creeping")
    threshold = 0.5 * float(np.abs(case().experiments[0].wrench[:, 0]).max())
    assert error_at_null(creeping, {"threshold": threshold, "time_constant": 10.0, "power": 1.0}) < TOLERANCE


@pytest.mark.parametrize("effect", one_form_of_each_label(), ids=lambda effect: effect.name)
def test_next_to_nothing_of_an_effect_changes_next_to_nothing_wherever_the_first_pose_is(
    effect: Effect,
) -> None:
    rest = case().experiments[0].position.copy()
    rest[0] += (2e-4, -1e-4, 2e-4)
    experiments = [replace(case().experiments[0], position=rest)]
    readings = [predicted_readings(one, BASE, zero) for one, zero in zip(baseline(), ZEROS, strict=True)]
    null = present(effect, effect.starts(readings)[0])
    free = next(c for c in free_parameters(null) if c.effect == 0 and c.pulled_to_null)
    little = free.put(null, 1e-4 * free.prior_scale)
    without, with_it = (
        read(
            [
                mechanics_of(
                    solve_case(replace(case(), experiments=experiments, loads=case().loads[:1]), one)[0]
                )
            ],
            one,
        )
        for one in (null, little)
    )
    assert np.abs(with_it - without).max() < 0.05


@pytest.mark.parametrize(
    "name",
    [
        "anchor_compliance:isotropic",
        "anchor_debonding:throughout",
        "anchor_debonding:from_an_instant",
        "gripper_slip:creeping",
        "strain_stiffening:gent",
        "viscoelasticity:one_term",
    ],
)
def test_the_derivative_where_an_effect_is_present_is_that_of_solved_neighbours(name: str) -> None:
    effect = next(one for one in CATALOGUE if one.name == name)
    readings = [predicted_readings(one, BASE, zero) for one, zero in zip(baseline(), ZEROS, strict=True)]
    starts = effect.starts(readings)
    constants = starts[len(starts) // 2]
    amplitude = effect.amplitudes[-1]
    here = BASE.with_effect(effect, {**constants, amplitude.name: amplitude.scale})
    assert error_where_present(here, amplitude.name, 0.02 * amplitude.scale) < 0.01


@pytest.mark.parametrize("name", ["viscoelasticity:one_term", "viscoelasticity:whole_stress"])
@pytest.mark.parametrize("parameter", ["poisson_ratio", "relaxation_time_1"])
def test_what_tissue_remembers_is_carried_along_the_fields_as_they_become(name: str, parameter: str) -> None:
    here = BASE.with_effect(named(name), {"relaxing_share_1": 0.5, "relaxation_time_1": 8.0})
    # Where the gripper stands the tangent is that of the state before.
    assert error_where_present(here, parameter, 0.01) < 0.03


def error_where_present(here: Hypothesis, parameter: str, size: float) -> float:
    """By how much the derivative by a parameter is off, as a share of it; ``size`` of a step in internal units."""
    coordinate = next(c for c in free_parameters(here) if c.key == parameter)
    at = coordinate.internal
    effect = None if coordinate.effect is None else here.effects[coordinate.effect]
    perturbation = Perturbation(
        coordinate.name, coordinate.put(here, at + coordinate.step), effect, coordinate.step
    )
    predicted = np.concatenate(
        [block[:, :, 0] for block in derivatives(solved(here), here, [perturbation], ZEROS)]
    )
    above, below = (coordinate.put(here, at + way * size) for way in (1.0, -1.0))
    resolved = (read(solved(above), above) - read(solved(below), below)) / (2 * size)
    return float(np.linalg.norm(predicted / DEVIATION - resolved) / np.linalg.norm(resolved))


@pytest.mark.parametrize("beside", ["anisotropy", "viscoelasticity:one_term", "anchor_compliance:isotropic"])
def test_stretches_of_anchor_come_off_beside_another_effect_as_solved_anew(beside: str) -> None:
    loose, other = (
        next(one for one in CATALOGUE if one.name == name) for name in ("anchor_debonding:throughout", beside)
    )
    readings = [predicted_readings(one, BASE, zero) for one, zero in zip(baseline(), ZEROS, strict=True)]
    amplitudes = {amplitude.name: 0.5 * amplitude.scale for amplitude in other.amplitudes}
    here = BASE.with_effect(other, {**other.starts(readings)[0], **amplitudes})
    places = (0.25, 1.0)
    steps = [
        Perturbation("share", here.with_effect(loose, {"share": 1e-4, "place": place}), loose, 1e-4)
        for place in places
    ]
    solved_here = solved(here)
    predicted = derivatives(solved_here, here, steps, ZEROS)
    for number, place in enumerate(places):
        slopes = []
        for share in (4e-3, 2e-3):
            off = here.with_effect(loose, {"share": share, "place": place})
            slopes.append((read(solved(off), off) - read(solved_here, here)) / share)
        resolved = 2 * slopes[1] - slopes[0]
        columns = np.concatenate([block[:, :, number] for block in predicted]) / DEVIATION
        assert np.linalg.norm(columns - resolved) < 0.02 * np.linalg.norm(resolved)


@pytest.mark.parametrize(
    ("form", "values"),
    [
        ("camera_scale:rest_measured_too", {"scale_error": 0.02, "shift_x": -1e-3}),
        ("camera_scale:of_rest_alone", {"scale_error": 0.02, "depth_error": 0.01}),
        ("camera_rotation:rest_measured_too", {"rotation_z": 0.03, "shift_y": 5e-4}),
        ("camera_rotation:of_rest_alone", {"rotation_z": -0.03}),
    ],
)
def test_beads_whose_rest_was_measured_by_such_cameras_sit_elsewhere_in_the_tissue(
    form: str, values: dict[str, float]
) -> None:
    effect = named(form)
    given = {amplitude.name: values.get(amplitude.name, 0.0) for amplitude in effect.amplitudes}
    here = BASE.with_effect(effect, given)
    loose = ~case().problem.fiducials_gripped
    stated = np.asarray(case().experiments[0].fiducials_rest)
    sits = here.problem(case().problem).fiducials_rest
    assert effect.seen(sits, given)[loose] == pytest.approx(stated[loose], abs=1e-6)
    seen = read(solved(here), here).reshape(-1, 54)[:, 6:] * DEVIATION[6:]
    at_rest = seen[0].reshape(-1, 3) - (stated if "too" in form else sits)
    assert np.abs(at_rest[loose]).max() < 1e-5
    null = BASE.with_effect(effect, dict.fromkeys(given, 0.0))
    for hypothesis in (null, here):
        number = next(iter(values))
        coordinate = next(c for c in free_parameters(hypothesis) if c.key == number)
        at = coordinate.internal
        step = Perturbation(number, coordinate.put(hypothesis, at + coordinate.step), effect, coordinate.step)
        predicted = derivatives(solved(hypothesis), hypothesis, [step], ZEROS)
        # One-sided: at the null some beads lie on faces of elements, where the strain jumps.
        above = coordinate.put(hypothesis, at + 1e-4)
        resolved = (read(solved(above), above) - read(solved(hypothesis), hypothesis)) / 1e-4
        columns = np.concatenate([block[:, :, 0] for block in predicted]) / DEVIATION
        assert np.linalg.norm(columns - resolved) < 1e-3 * np.linalg.norm(resolved)


@pytest.mark.parametrize("scale", ["camera_scale:uniform", "camera_scale:of_the_motion"])
@pytest.mark.parametrize(
    ("mounted", "values"),
    [
        ("prestretch:beads_known_after", {"drawn_x": 1e-3, "drawn_y": 0.0}),
        ("gravity_sag:beads_hanging", {"weight": 0.01}),
    ],
)
def test_cameras_of_a_wrong_scale_have_read_the_rest_positions_of_mounted_tissue(
    scale: str, mounted: str, values: dict[str, float]
) -> None:
    here = BASE.with_effect(named(mounted), values).with_effect(named(scale), {"scale_error": 0.02})
    seen = read(solved(here), here).reshape(-1, 54)[:, 6:] * DEVIATION[6:]
    stated = np.ravel(case().experiments[0].fiducials_rest)
    assert np.abs(seen[0] - stated).max() < 2e-6
    coordinate = free_parameters(here)[-1]
    step = Perturbation(
        coordinate.name, coordinate.put(here, 0.02 + coordinate.step), here.effects[1], coordinate.step
    )
    predicted = derivatives(solved(here), here, [step], ZEROS)
    above, below = (coordinate.put(here, 0.02 + way) for way in (1e-3, -1e-3))
    resolved = (read(solved(above), above) - read(solved(below), below)) / 2e-3
    columns = np.concatenate([block[:, :, 0] for block in predicted]) / DEVIATION
    assert np.linalg.norm(columns - resolved) < 0.01 * np.linalg.norm(resolved)


def test_beads_that_such_cameras_list_sit_where_they_would_be_seen_there() -> None:
    def sit(drawn_x: float) -> FloatArray:
        drawn = BASE.with_effect(named("prestretch:beads_known_after"), {"drawn_x": drawn_x, "drawn_y": 0.0})
        here = drawn.with_effect(named("camera_scale:uniform"), {"scale_error": 0.02})
        return here.problem(case().problem).fiducials_rest[~case().problem.fiducials_gripped]

    stated = case().problem.fiducials_rest[~case().problem.fiducials_gripped]
    assert 1.02 * sit(drawn_x=1e-9) == pytest.approx(stated, abs=1e-6)
    # Without that effect the list is the phantom's design.
    assert sit(drawn_x=0.0) == pytest.approx(stated)


def test_a_bead_that_such_cameras_see_below_the_surface_of_gripped_tissue_stays_in_the_grip() -> None:
    mounted = BASE.with_effect(named("prestretch:beads_known_after"), {"drawn_x": 1e-9, "drawn_y": 0.0})
    shrunk = mounted.with_effect(named("camera_scale:uniform"), {"scale_error": -0.01})
    on_top = np.array([*case().problem.grasp_centre[:2], case().problem.body.mesh.points[:, 2].max()])
    stated = case().problem.fiducials_rest.copy()
    stated[0] = on_top
    problem = with_beads_at(case().problem, stated)
    assert problem.fiducials_gripped[0]
    assert shrunk.problem(problem).fiducials_gripped[0]


def test_a_pose_to_which_tissue_without_memory_returns_is_solved_once() -> None:
    elastic = solve_case(case(), BASE)[0]
    assert elastic.states[1] is elastic.states[-2]
    effect = next(one for one in CATALOGUE if one.name == "viscoelasticity:one_term")
    relaxing = BASE.with_effect(effect, {"relaxation_time_1": 10.0, "relaxing_share_1": 0.3})
    remembering = solve_case(case(), relaxing)[0]
    assert np.abs(remembering.states[1].forces - remembering.states[-2].forces).max() > 1e-4


def test_a_solution_that_starts_from_a_neighbours_fields_is_the_one_found_from_rest() -> None:
    effect = next(one for one in CATALOGUE if one.name == "viscoelasticity:one_term")
    relaxing = BASE.with_effect(effect, {"relaxation_time_1": 10.0, "relaxing_share_1": 0.1})
    known = [one.known_fields() for one in solve_case(case(), relaxing)]
    more = BASE.with_effect(effect, {"relaxation_time_1": 10.0, "relaxing_share_1": 0.2})
    near = [mechanics_of(one) for one in solve_case(case(), more, known)]
    assert np.abs(read(near, more) - read(solved(more), more)).max() < 0.01
