"""What left-out experiments say of a cause."""

from dataclasses import replace

import numpy as np
import pytest
from effect_cases import there_and_back
from numpy.typing import NDArray

from estimator.diagnosis.conclusions.gap import gap_of
from estimator.diagnosis.evidence.cross_validation import (
    held_out_in_full,
    held_out_residuals,
    lost_on_held_out,
)
from estimator.diagnosis.fitting.case import Case, Linearisation, linearise, residuals_near
from estimator.diagnosis.model.free_parameters import free_parameters
from estimator.diagnosis.model.grip_load import GripLoad
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.setup import Setup
from estimator.diagnosis.model.solution import Mechanics, mechanics_of, solve_case
from estimator.diagnosis.noise.correlated_errors import correlated_errors_of, left_at_grasp
from estimator.diagnosis.noise.estimation import Noise
from estimator.diagnosis.result import Gap
from estimator.diagnosis.sensitivity.readings import channels, predicted_readings
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.effects.catalogue import CATALOGUE
from estimator.effects.force.torque_centre import TorqueCentre
from estimator.fem.discretisation.block_mesh import Grading
from estimator.forward.meshing import mesh_experiment
from estimator.inference.whitening import Whitening
from estimator.workers import worker_pool

SETTINGS = DiagnosisSettings()

MATERIAL = Hypothesis(1e4, 0.45)


def fitted(*sizes: float) -> Linearisation:
    """A fit whose residual in each experiment has some length, and nothing along E or nu."""
    rng = np.random.default_rng(3)
    found = [np.linalg.qr(rng.normal(size=(30, 3)))[0] for _ in sizes]
    residual = tuple(size * block[:, 2] for size, block in zip(sizes, found, strict=True))
    columns = tuple(block[:, :2] for block in found)
    return Linearisation(MATERIAL, free_parameters(MATERIAL), (), residual, columns, (), ())


def test_what_a_cause_makes_worse_there_is_lost_by_half_its_square() -> None:
    assert lost_on_held_out(fitted(3.0, 5.0), fitted(3.0, 4.0), SETTINGS.evidence) == pytest.approx(
        (25.0 - 16.0) / 2.0
    )


def test_what_it_makes_better_costs_nothing() -> None:
    assert lost_on_held_out(fitted(3.0, 2.0), fitted(3.0, 4.0), SETTINGS.evidence) == 0.0


def test_one_experiment_alone_does_not_speak_against_a_cause() -> None:
    assert lost_on_held_out(fitted(5.0), fitted(4.0), SETTINGS.evidence) == 0.0


def test_a_parameter_that_only_one_experiment_sees_is_not_held_against_it() -> None:
    # The second experiment hardly sees the offset: by itself it would put it far from where the first has it.
    rng = np.random.default_rng(8)
    effect = TorqueCentre("gripper")
    hypothesis = MATERIAL.with_effect(effect, {a.name: 0.0 for a in effect.amplitudes})
    free = free_parameters(hypothesis)
    sees = [np.linalg.qr(rng.normal(size=(60, len(free))))[0] for _ in range(2)]
    for block, strength in zip(sees, (1e5, 1e3), strict=True):
        block[:, 2:] *= strength
    noise = [rng.normal(size=60) for _ in range(2)]
    offset = 4e-3 * sees[0][:, 2:].sum(axis=1)
    baseline = Linearisation(
        MATERIAL, free[:2], (), (noise[0] + offset, noise[1]), tuple(b[:, :2] for b in sees), (), ()
    )
    found = Linearisation(hypothesis, free, (), tuple(noise), tuple(sees), (), ())
    assert lost_on_held_out(found, baseline, SETTINGS.evidence) == 0.0
    elsewhere = Linearisation(
        hypothesis, free, (), (noise[0], noise[1] + 20 * sees[0][:, 0]), tuple(sees), (), ()
    )
    assert (
        lost_on_held_out(elsewhere, replace(baseline, residual=(noise[0], noise[1])), SETTINGS.evidence)
        > 100.0
    )


def stiffer_than_measured() -> tuple[Case, Linearisation]:
    """Two retractions of plain tissue, compared with tissue that stiffens."""
    grading = Grading(grasp_m=6e-3, anchor_m=10e-3, largest_m=30e-3, growth=3.0, layers=1)
    planned = [there_and_back().experiment, there_and_back(order=2, turn_rad=(0.0, 0.0, 0.4)).experiment]
    problem = mesh_experiment(planned[0], grading)
    zeros = tuple(np.zeros((len(one.time), 6 + 3 * len(one.fiducials_rest))) for one in planned)
    loads = tuple(GripLoad(one.wrench, one.wrench / 1e4) for one in planned)
    plain = [mechanics_of(solution) for solution in solve_case(Setup(planned, problem, loads), MATERIAL)]
    seen = [
        replace(
            one,
            wrench=m.wrench[m.solution.load_steps.of_row],
            fiducials=m.fiducials[m.solution.load_steps.of_row],
        )
        for one, m in zip(planned, plain, strict=True)
    ]
    whitenings = tuple(
        correlated_errors_of(m, zero, Noise(), SETTINGS.noise).whitening()
        for m, zero in zip(plain, zeros, strict=True)
    )
    case = Case(tuple(seen), problem, loads, zeros, whitenings)
    gent = next(one for one in CATALOGUE if one.name == "strain_stiffening:gent")
    return case, linearise(case, MATERIAL.with_effect(gent, {"inverse_limit": 0.3}))


def test_what_meshes_make_of_the_edges_of_the_grasp_is_forgiven_and_nothing_else() -> None:
    motion = there_and_back().experiment
    problem = mesh_experiment(
        motion, Grading(grasp_m=6e-3, anchor_m=10e-3, largest_m=30e-3, growth=3.0, layers=1)
    )
    solution = solve_case(Setup([motion], problem, (GripLoad.none(len(motion.time)),)), MATERIAL)[0]
    zero = np.zeros((len(motion.time), 6 + 3 * len(motion.fiducials_rest)))
    forgiven, other = 1e-4 * np.random.default_rng(6).normal(size=(2, *zero.shape))
    mechanics = mechanics_of(solution)
    strict = correlated_errors_of(mechanics, zero, Noise(), SETTINGS.noise).whitening()
    lenient = correlated_errors_of(mechanics, zero, Noise(), SETTINGS.noise, forgiven[:, :, None]).whitening()

    def size(whitening: Whitening, misfit: NDArray[np.float64]) -> float:
        return float(np.linalg.norm(whitening.apply(misfit[:, :, None])))

    # However many deviations of noise it has, what is forgiven counts as one of its own.
    assert size(strict, forgiven) > 5.0
    assert size(lenient, forgiven) == pytest.approx(1.0, rel=0.02)
    assert size(lenient, other) == pytest.approx(size(strict, other), rel=0.02)


def test_meshes_shift_and_turn_the_edges_of_the_grasp() -> None:
    motion = there_and_back(turn_rad=(0.0, 0.0, 0.4)).experiment
    problem = mesh_experiment(
        motion, Grading(grasp_m=6e-3, anchor_m=10e-3, largest_m=30e-3, growth=3.0, layers=1)
    )

    def solved(hypothesis: Hypothesis) -> Mechanics:
        return mechanics_of(
            solve_case(Setup([motion], problem, (GripLoad.none(len(motion.time)),)), hypothesis)[0]
        )

    zero = np.zeros((len(motion.time), 6 + 3 * len(motion.fiducials_rest)))
    (left,) = left_at_grasp([solved(MATERIAL)], MATERIAL, [zero], SETTINGS.noise)
    # At a Poisson ratio of 0.45 an edge seems to lie aside by 20 um. When turned it does so at the root mean square of
    # the distances of its points from its middle.
    edge = motion.grasp.box.upper[0] - motion.grasp.box.lower[0]
    turn = 2e-5 / (edge / 12**0.5)
    jaws, turned = (
        next(one for one in CATALOGUE if one.name == f"grasp_misplacement:{form}")
        for form in ("jaws", "turned")
    )
    at_rest = channels(predicted_readings(solved(MATERIAL), MATERIAL, zero))
    for number, (effect, name, deviation) in enumerate(
        [(jaws, "shift_x", 2e-5), (jaws, "shift_y", 2e-5), (turned, "yaw", turn)]
    ):
        values = {one.name: deviation if one.name == name else 0.0 for one in effect.amplitudes}
        there = MATERIAL.with_effect(effect, values)
        change = channels(predicted_readings(solved(there), there, zero)) - at_rest
        for kind in (slice(0, 3), slice(3, 6), slice(6, None)):
            error = left[:, kind, number] - change[:, kind]
            assert np.abs(error).max() < 0.05 * np.abs(change[:, kind]).max()


def test_what_the_others_would_move_by_much_is_solved_in_full() -> None:
    case, fit = stiffer_than_measured()
    with worker_pool(1) as executor:
        in_full = held_out_in_full(case, fit, executor)
    # The other retraction brings plain tissue back, which leaves of the misfit what a derivative does not foretell.
    for full, extrapolated, before in zip(
        in_full, held_out_residuals(fit, SETTINGS.evidence), fit.residual, strict=True
    ):
        assert np.linalg.norm(full) < 0.5 * np.linalg.norm(extrapolated) < 0.5 * np.linalg.norm(before)


def test_where_no_step_fits_the_others_better_they_agree_with_the_fit_to_all() -> None:
    case, fit = stiffer_than_measured()
    # The first retraction says that nothing is amiss with the fit, and derivatives that lie send it far away.
    lying = replace(fit, jacobian=tuple(-columns for columns in fit.jacobian))
    with worker_pool(1) as executor:
        in_full = held_out_in_full(case, lying, executor)
    assert in_full[0] == pytest.approx(fit.residual[0])


def test_residuals_without_derivatives_are_those_of_the_linearisation() -> None:
    case, fit = stiffer_than_measured()
    for alone, among in zip(residuals_near(case, fit.hypothesis, fit), fit.residual, strict=True):
        assert alone == pytest.approx(among, abs=1e-2)


def only_the_second_sees() -> Linearisation:
    """A fit whose last parameter, an offset of the torque's centre, shows in the second experiment alone."""
    rng = np.random.default_rng(4)
    effect = TorqueCentre("gripper")
    hypothesis = MATERIAL.with_effect(effect, {a.name: 2e-3 for a in effect.amplitudes})
    free = free_parameters(hypothesis)
    columns = [1e-2 * rng.normal(size=(400, len(free))) for _ in range(2)]
    columns[0][:, 2:] = 0.0
    columns[1][:, 2:] *= 1e6
    residual = tuple(rng.normal(size=400) for _ in range(2))
    return Linearisation(hypothesis, free, (), residual, tuple(columns), (), ())


def test_of_what_befell_one_experiment_alone_its_own_other_rows_tell() -> None:
    fit = only_the_second_sees()
    for left_out, residual in zip(held_out_residuals(fit, SETTINGS.evidence), fit.residual, strict=True):
        assert len(left_out) == len(residual)
        # Noise that is not explained by what was fitted to it.
        assert 0.9 < np.sqrt(np.mean(left_out**2)) < 1.15


def test_the_uncertainty_of_a_closure_is_how_it_scatters_from_one_noise_to_the_next() -> None:
    rng = np.random.default_rng(5)

    def gap() -> Gap:
        lasting = np.repeat(rng.normal(size=(3, 10)), 60, axis=1)
        noise = rng.normal(size=(3, 600))
        return gap_of(list(noise + lasting), list(noise + 0.3 * lasting), 1.0, SETTINGS.conclusions)

    found = [gap() for _ in range(200)]
    scatter = np.std([one.closure_held_out for one in found])
    assert np.median([one.closure_std for one in found]) == pytest.approx(scatter, rel=0.3)


def test_a_gap_within_the_noise_has_no_closure_and_none_that_is_sure() -> None:
    noise = [np.random.default_rng(6).normal(size=600)]
    found = gap_of(noise, noise, 1.0, SETTINGS.conclusions)
    assert np.isnan(found.closure_held_out)
    assert np.isnan(found.closure_std)


def test_channels_that_nobody_measured_have_no_gap() -> None:
    found = gap_of([np.zeros(0)], [np.zeros(0)], 1.0, SETTINGS.conclusions)
    assert np.isnan([found.before, found.after, found.closure_held_out]).all()
