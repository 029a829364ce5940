"""What a finer mesh leaves of a mesh's error, by how much finer it is."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from organ_cases import organ_meshed_anew
from retraction_cases import SMALL_BLOCK

from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.noise.correlated_errors import beads_beside_rim, edge_deviation, left_beside_rim
from estimator.diagnosis.noise.refinement import OF_BLOCKS, Refinement, grading_of, refinement_of
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.experiment import Experiment

SETTINGS = DiagnosisSettings().noise
SHARES = [SETTINGS.mesh_share_apart, SETTINGS.mesh_share_together, SETTINGS.mesh_share_beside_rim]


@pytest.fixture(scope="module")
def pull(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Experiment]:
    with organ_meshed_anew(tmp_path_factory) as planned:
        yield planned


def left_of(order: float, rim_m: float, finer_m: float) -> float:
    """The error of the finer mesh over what it changes, of one that falls with a power of the element size."""
    coarse, fine = (one**order for one in (rim_m, finer_m))
    return float(fine / (coarse - fine))


@given(st.floats(0.3, 3.0), st.floats(1.2, 6.0))
def test_what_is_left_follows_from_how_much_finer_the_mesh_is(order: float, ratio: float) -> None:
    of_block = left_of(order, OF_BLOCKS.rim_m, OF_BLOCKS.finer_rim_m)
    assert Refinement(ratio, 1.0).share_left(of_block) == pytest.approx(left_of(order, ratio, 1.0))


@pytest.mark.parametrize("share", SHARES)
def test_of_a_block_is_left_what_was_learnt_on_blocks(share: float) -> None:
    assert refinement_of(SMALL_BLOCK).share_left(share) == pytest.approx(share, rel=1e-12)


@pytest.mark.parametrize("share", SHARES)
def test_of_an_organ_is_left_more_for_its_tetrahedra_are_but_halved(pull: Experiment, share: float) -> None:
    refinement = refinement_of(pull)
    assert refinement.ratio == pytest.approx(2.0)
    assert 2.5 * share < refinement.share_left(share) < 4 * share


def test_an_error_that_falls_with_the_element_size_leaves_all_of_what_halving_changes() -> None:
    assert Refinement(2e-3, 1e-3).share_left(1 / 3) == pytest.approx(1.0)


def test_the_edges_of_a_grasp_are_shifted_in_proportion_to_the_elements(pull: Experiment) -> None:
    one = Hypothesis(8e3, 0.45)
    of_block, of_organ = (edge_deviation(one, refinement_of(each), SETTINGS) for each in (SMALL_BLOCK, pull))
    assert of_block == pytest.approx(20e-6)
    assert of_organ / of_block == pytest.approx(refinement_of(pull).finer_rim_m / OF_BLOCKS.finer_rim_m)


def test_beads_feel_the_rim_of_a_grasp_from_as_many_elements_away(pull: Experiment) -> None:
    near = SETTINGS.beside_rim * refinement_of(pull).rim_m
    tip = np.array(pull.grasp.box.lower) * [1, 0, 0]
    away = np.array([0.5, 0.95, 1.05, 2.0]) * near
    beads = np.array([tip - [x, 0.0, 0.0] for x in away])
    distance = pull.grasp.box.distance(beads)
    with_beads = replace(pull, fiducials_rest=beads, fiducials=np.stack([beads, beads]))
    assert beads_beside_rim(with_beads, SETTINGS) == np.flatnonzero(distance < near).tolist()
    assert 0 < np.count_nonzero(distance < near) < 4


def test_what_is_left_of_a_bead_beside_the_rim_grows_with_the_share(pull: Experiment) -> None:
    beads = np.array(pull.grasp.box.lower) * [1, 0, 0] - [[5e-3, 0.0, 0.0]]
    beside = replace(pull, fiducials_rest=beads, fiducials=np.stack([beads, beads]))
    correction = np.zeros((2, 9))
    correction[1, 6:] = 1e-4, 0.0, 0.0
    (directions,) = left_beside_rim(beside, correction, SETTINGS).values()
    largest = refinement_of(pull).share_left(SETTINGS.mesh_share_beside_rim) * 1e-4
    assert np.linalg.norm(directions[1, 6]) == pytest.approx(largest)


def test_hypotheses_about_an_organ_are_solved_on_larger_elements(pull: Experiment) -> None:
    assert grading_of(pull).largest_m > grading_of(SMALL_BLOCK).largest_m
    assert grading_of(pull).grasp_m == grading_of(SMALL_BLOCK).grasp_m
