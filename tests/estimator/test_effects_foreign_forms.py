"""A label is a family: of a cause that another hand has written, the family's label is the more probable one."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from foreign_forms import (
    HERE,
    FanOfFibres,
    LevellingStiffening,
    PartialSlip,
    PastyTable,
    PowerLawRelaxation,
    SecondOrderFilter,
    SoakingHeat,
    SoftBlob,
    WronglyScaled,
)
from numpy.typing import NDArray
from retraction_cases import REFERENCE_BLOCK, with_rows
from scipy.spatial.transform import Rotation

from estimator.diagnosis.evidence.marginal_likelihood import error_borne_out, first_order_evidence
from estimator.diagnosis.fitting.case import Case, linearise
from estimator.diagnosis.fitting.refit import refit
from estimator.diagnosis.model.grip_load import GripLoad
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.setup import Setup
from estimator.diagnosis.model.solution import mechanics_of, solve_case
from estimator.diagnosis.noise.correlated_errors import correlated_errors_of
from estimator.diagnosis.noise.estimation import Noise
from estimator.diagnosis.search.candidate import Candidate, most_probable_first
from estimator.diagnosis.search.context import Context
from estimator.diagnosis.search.racing import race
from estimator.diagnosis.search.refinements import at_the_place_of, elaborations, with_material_of
from estimator.diagnosis.search.screening import best_starts, screen
from estimator.diagnosis.sensitivity.readings import predicted_readings
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.effects.catalogue import default_catalogue
from estimator.effects.effect import Effect
from estimator.experiment import Experiment
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.discretisation.block_mesh import Grading
from estimator.forward.meshing import mesh_experiment

FloatArray = NDArray[np.float64]
# What is made and what is refitted share the mesh: eight elements tell forms apart as well as thousands.
TINY = Grading(grasp_m=20e-3, anchor_m=30e-3, largest_m=40e-3, growth=4.0, layers=1)
LENGTH_M = np.array([0.015, 0.0, 0.0])
TRUTH = Hypothesis(12e3, 0.42)
CATALOGUE = default_catalogue()


def planned(order: int, turn_deg: Sequence[float], seconds: float) -> Experiment:
    """Out in three steps of these seconds, a hold of as many rows, and back in one; the second one turns as it goes."""
    way = np.concatenate([np.linspace(0, 1, 4), np.ones(3), [0.0]])
    turn, start = np.radians(turn_deg), np.array(REFERENCE_BLOCK.grasp.centre)
    poses = [GripperPose(start + s * LENGTH_M, Rotation.from_rotvec(s * turn)) for s in way]
    rows = len(poses)
    blank = with_rows(REFERENCE_BLOCK, poses, np.zeros((rows, 6)), np.zeros((rows, 16, 3)))
    phase = ("hold", *3 * ("ramp",), *3 * ("hold",), "return")
    return replace(blank, order=order, time=seconds * blank.time, phase=phase)


PLANNED = (planned(1, (0, 0, 0), 1.7), planned(2, (30, 0, 20), 5.0))


def recorded(effect: Effect) -> list[Experiment]:
    """The planned experiments as they go with the effect, with the noise of their sensors."""
    truth, rng = TRUTH.with_effect(effect, HERE), np.random.default_rng(5)
    problem, sensor = mesh_experiment(PLANNED[0], TINY), REFERENCE_BLOCK.sensor
    idle = [GripLoad.none(len(each.time)) for each in PLANNED]
    unslipped = [mechanics_of(one) for one in solve_case(Setup(PLANNED, problem, idle), TRUTH)]
    felt = [one.wrench[one.solution.load_steps.of_row] for one in unslipped]
    setup = Setup(PLANNED, problem, [GripLoad(each, each / TRUTH.youngs_modulus) for each in felt])
    found = []
    for solution, each in zip(solve_case(setup, truth), PLANNED, strict=True):
        seen = predicted_readings(mechanics_of(solution), truth, np.zeros((len(each.time), 54)))
        deviation = np.repeat([sensor.force_std, sensor.torque_std], 3)
        wrench = seen.wrench + deviation * rng.normal(size=seen.wrench.shape)
        beads = seen.fiducials + sensor.fiducial_std * rng.normal(size=seen.fiducials.shape)
        found.append(replace(each, wrench=wrench, fiducials=beads))
    return found


def context_of(experiments: Sequence[Experiment], workers: ThreadPoolExecutor) -> Context:
    """The fitted baseline of experiments, on the mesh with which they were made."""
    problem = mesh_experiment(experiments[0], TINY)
    idle = [GripLoad.none(len(each.time)) for each in experiments]
    mechanics = [mechanics_of(one) for one in solve_case(Setup(experiments, problem, idle), TRUTH)]
    zeros = [np.zeros((len(each.time), 54)) for each in experiments]
    whitenings = [
        correlated_errors_of(one, zero, Noise(), DiagnosisSettings().noise).whitening()
        for one, zero in zip(mechanics, zeros, strict=True)
    ]
    case = Case(tuple(experiments), problem, tuple(idle), tuple(zeros), tuple(whitenings))
    baseline = refit(case, TRUTH, linearise(case, TRUTH), evaluations=4)
    modulus = baseline.hypothesis.youngs_modulus
    loads = tuple(
        GripLoad(each.wrench, predicted[:, :6] / modulus)
        for each, predicted in zip(experiments, baseline.predicted, strict=True)
    )
    error = error_borne_out(case, baseline)
    loaded = replace(case, loads=loads)
    return Context(loaded, baseline, error, workers, lambda stage, done, total: None, CATALOGUE)


def refitted(context: Context, labels: Sequence[str]) -> list[Candidate]:
    """The best places of the plain forms of some labels, and of the finer ones of the first label."""
    plain = [one for one in CATALOGUE.effects if one.label in labels and not one.elaborates]
    none = first_order_evidence(context.case, context.baseline, context.error)
    found = race(context, [trial.start for trial in best_starts(screen(context, plain), 1)], none)
    leader = next(one for one in found if one.labels == (labels[0],))
    finer = screen(context.beside(with_material_of(context, leader)), elaborations(CATALOGUE, labels[:1]))
    begun = [trial.start for trial in best_starts(finer, 1)] + at_the_place_of(context, leader, found)
    return most_probable_first([*found, *race(context, begun, none)])


# What was written elsewhere, the label that a laboratory would give it, and labels that look much the same.
FORMS = [
    (PowerLawRelaxation(), "viscoelasticity", ("force_drift", "permanent_set")),
    (LevellingStiffening(), "strain_stiffening", ("second_invariant", "modulus_gradient")),
    (PartialSlip(), "gripper_slip", ("gripper_compliance", "motion_scale")),
    (PastyTable(), "support_friction", ("viscoelasticity", "gripper_compliance")),
    (FanOfFibres(), "anisotropy", ("modulus_gradient", "second_invariant")),
    (SoftBlob(), "inhomogeneity", ("modulus_gradient", "anchor_debonding")),
    (WronglyScaled(), "force_axis_gain", ("force_frame_rotation", "torque_centre")),
    (SoakingHeat(), "force_drift", ("force_bias", "tool_weight")),
    (SecondOrderFilter(), "time_offset", ("robot_backlash", "force_drift")),
]


@pytest.mark.parametrize(("effect", "label", "rivals"), FORMS, ids=[type(one).__name__ for one, *_ in FORMS])
def test_the_label_of_a_form_that_is_not_in_the_catalogue_leads(
    effect: Effect, label: str, rivals: tuple[str, ...]
) -> None:
    with ThreadPoolExecutor(2) as workers:
        found = refitted(context_of(recorded(effect), workers), (label, *rivals))
    of_others = max(one.log_evidence for one in found if one.labels[0] != label)
    assert found[0].labels == (label,)
    assert found[0].log_evidence > of_others + 5.0
