"""The mesh on which an estimate and a diagnosis measure the error of an organ's: its own, halved."""

from collections.abc import Iterator

import numpy as np
import pytest
from organ_cases import organ_meshed_anew

from estimator.diagnosis.noise.refinement import measured_on, solved_on
from estimator.experiment import Experiment
from estimator.forward.finer import measuring_mesh
from estimator.forward.meshing import mesh_experiment


@pytest.fixture(scope="module")
def pull(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Experiment]:
    with organ_meshed_anew(tmp_path_factory, 2) as planned:
        yield planned


def test_an_estimate_and_a_diagnosis_solve_and_measure_on_the_same_meshes_of_an_organ(
    pull: Experiment,
) -> None:
    solved, measured = mesh_experiment(pull).body.mesh, measuring_mesh(pull).body.mesh
    assert len(measured.cells) == 8 * len(solved.cells)
    assert np.array_equal(solved_on(pull).body.mesh.points, solved.points)
    assert np.array_equal(measured_on(pull).body.mesh.points, measured.points)
