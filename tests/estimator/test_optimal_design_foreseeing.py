"""What answers foresee of a planned retraction, on a very coarse mesh."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from bare_contexts import bare_case
from synthetic_diagnoses import small_experiment

from estimator.diagnosis.fitting.case import Case
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.effects.catalogue import default_catalogue
from estimator.experiment import Experiment
from estimator.fem.discretisation.block_mesh import Grading
from estimator.forward.meshing import mesh_experiment
from estimator.optimal_design.beliefs import Belief
from estimator.optimal_design.foreseeing import Foresight, foresee
from estimator.optimal_design.information import expected_information

TINY = Grading(grasp_m=6e-3, anchor_m=10e-3, largest_m=30e-3, growth=3.0, layers=1)
BASELINE = Hypothesis(15e3, 0.4)
GAIN = next(one for one in default_catalogue().effects if one.name == "force_axis_gain:fx")


@cache
def case() -> Case:
    done = small_experiment()
    return replace(bare_case([done]), problem=mesh_experiment(done, TINY))


def pull(way_m: float) -> Experiment:
    """At rest, half way, all the way."""
    whole, share = small_experiment(order=2), np.array([0.0, 0.5, 1.0])
    return replace(
        whole,
        time=2.0 * np.arange(3),
        phase=("hold", "hold", "hold"),
        step=np.arange(3),
        position=np.array([0.04, 0.0, 0.0]) + np.outer(share * way_m, [1.0, 0.0, 0.0]),
        quaternion_wxyz=np.tile([1.0, 0.0, 0.0, 0.0], (3, 1)),
        wrench=np.full((3, 6), np.nan),
        fiducials=np.full((3, 16, 3), np.nan),
    )


def answers(gain: float, modulus_known_to: float = 0.01) -> list[Belief]:
    """A force that reads too much along x, or none."""
    root = np.diag([modulus_known_to, 0.01])
    with_gain = np.diag([modulus_known_to, 0.01, 0.01])
    return [
        Belief("force_axis_gain", 0.5, GAIN, {}, np.array([0.0, 0.0, gain]), with_gain),
        Belief("none", 0.5, None, {}, np.zeros(2), root),
    ]


@cache
def foreseen(way_m: float, gain: float, modulus_known_to: float = 0.01) -> Foresight:
    found = foresee(case(), BASELINE, answers(gain, modulus_known_to), pull(way_m))
    assert found is not None
    return found


def told(foresight: Foresight) -> float:
    return expected_information([0.5, 0.5], foresight.by_answer).nats


def test_a_longer_pull_is_foreseen_to_pull_harder() -> None:
    near, far = (foreseen(way_m, 0.0).largest_force for way_m in (0.005, 0.01))
    assert 1.5 < far / near < 3.0


def test_the_load_of_the_answer_that_pulls_hardest_counts() -> None:
    assert foreseen(0.01, 0.5).largest_force > 1.3 * foreseen(0.01, 0.0).largest_force


def test_tissue_of_a_stiffness_that_is_hardly_known_may_pull_harder() -> None:
    assert foreseen(0.01, 0.0, 0.3).largest_force > 1.4 * foreseen(0.01, 0.0).largest_force


@pytest.mark.parametrize("modulus_known_to", [0.01, 0.1])
def test_the_farther_apart_two_answers_are_the_more_a_pull_tells(modulus_known_to: float) -> None:
    slight, clear = (told(foreseen(0.01, gain, modulus_known_to)) for gain in (0.03, 0.3))
    assert slight < clear <= np.log(2.0) + 1e-6


def test_a_longer_pull_tells_more_of_a_gain() -> None:
    assert told(foreseen(0.005, 0.05)) < told(foreseen(0.01, 0.05))
