"""A strip so thin that it bends under next to nothing, drawn far and back while its stress relaxes."""

from dataclasses import replace

import numpy as np
import pytest
from retraction_cases import block_at_rest, with_rows
from scipy.spatial.transform import Rotation

from estimator.diagnosis.fitting.case import Case, linearise
from estimator.diagnosis.fitting.refit import refit
from estimator.diagnosis.model.grip_load import GripLoad
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.effects.catalogue import CATALOGUE
from estimator.experiment import Box, Environment, Experiment, SensorNoise
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.discretisation.block_mesh import Grading
from estimator.forward.meshing import mesh_experiment
from estimator.inference.whitening import Whitening
from estimator.materials import NeoHookean
from estimator.materials.material import Material
from estimator.simulation.acting import ActingEffect
from estimator.simulation.simulate import Resolution, simulate_case

COARSE = Grading(grasp_m=2e-3, anchor_m=6e-3, largest_m=15e-3, growth=2.5, layers=1)
RELAXING = next(effect for effect in CATALOGUE if effect.name == "viscoelasticity:one_term")
TRUE = {"relaxing_share_1": 1.3, "relaxation_time_1": 6.0}


@pytest.fixture(scope="module")
def strip() -> Experiment:
    rest = block_at_rest(
        (0.082, 0.01, 0.001),
        Box((0.039, -0.005, -0.0005), (0.041, 0.005, 0.0005)),
        SensorNoise(0.01, 1e-3, 1e-4, 1e-5),
        np.zeros((0, 3)),
    )
    rest = replace(rest, environment=Environment((0.0, 0.0, 0.0), "none"))
    way = 0.04 * np.array([0.0, 0.12, 0.25, 0.4, 0.55, 0.7, 0.85, 1.0, 0.8, 0.6, 0.45, 0.3])
    poses = [GripperPose(np.array([0.04 + travel, 0.0, 0.0]), Rotation.identity()) for travel in way]
    planned = with_rows(rest, poses, np.zeros((len(way), 6)), np.zeros((len(way), 0, 3)))
    tissue = Material(NeoHookean(), 75e3, 0.46)
    (seen,) = simulate_case(
        [replace(planned, time=2.0 * np.arange(len(way)))],
        tissue,
        1,
        [ActingEffect(RELAXING, TRUE)],
        resolution=Resolution(COARSE, "hex27"),
    )
    return seen


def test_its_relaxation_is_refitted_to_the_end(strip: Experiment) -> None:
    """On the way the tangent of a trial may be indefinite where that of the equilibrium is not."""
    rows = len(strip.time)
    deviation = np.repeat([0.01, 1e-3], 3)
    white = Whitening(np.isfinite(strip.wrench), deviation, np.zeros(6), np.zeros((6 * rows, 0)), np.zeros(0))
    case = Case(
        (strip,),
        mesh_experiment(strip, COARSE),
        (GripLoad.none(rows),),
        (np.zeros((rows, 6)),),
        (white,),
        settings=DiagnosisSettings(),
    )
    start = Hypothesis(98e3, 0.467).with_effect(RELAXING, {"relaxing_share_1": 1.0, "relaxation_time_1": 8.0})
    begun = linearise(case, start)
    found = refit(case, start, begun, evaluations=8)
    assert begun.chi2 > 10.0 * rows
    assert found.chi2 < 1.5 * 6 * rows
