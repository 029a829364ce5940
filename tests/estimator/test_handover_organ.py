"""An organ with a stiffer region for other simulators: with it where they can, and said to be left out where not."""

from collections.abc import Iterator

import numpy as np
import pytest
from handover_cases import handed_to
from organ_cases import RATIO, organ_meshed_anew

from estimator.experiment import Experiment
from estimator.fem.discretisation.block_mesh import Grading
from estimator.handover.calculix.deck import deck_of
from estimator.handover.calculix.engine import CalculiX
from estimator.handover.mujoco.engine import MuJoCo

COARSE = Grading(grasp_m=8e-3, anchor_m=12e-3, largest_m=24e-3, growth=3.0, layers=1)


@pytest.fixture(scope="module")
def pull(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Experiment]:
    with organ_meshed_anew(tmp_path_factory, 2) as planned:
        yield planned


def test_calculix_gets_the_region(pull: Experiment) -> None:
    handed = handed_to(CalculiX(), experiments=[pull], grading=COARSE)
    assert handed.left_out == {}
    # two meshes differ, and none need have an element that lies in the region as a whole
    assert 0.5 * (1.0 + RATIO) < handed.stiffness.max() < RATIO * (1.0 + 1e-9)
    assert np.median(handed.stiffness) == pytest.approx(1.0)
    assert "TISSUE2" in deck_of(handed, handed.runs[0])


def test_mujoco_gets_a_body_without_it_and_that_is_said(pull: Experiment) -> None:
    handed = handed_to(MuJoCo(), experiments=[pull], grading=COARSE)
    assert handed.left_out == {"phantom.region": "MuJoCo gets one stiffness for the whole body"}
    assert np.array_equal(handed.stiffness, np.ones_like(handed.stiffness))
    assert np.array_equal(handed.problem.body.modulus, np.ones_like(handed.problem.body.modulus))
