"""A grasp that is a face: a plate glued to the end of a body, which grips no tissue behind it."""

from dataclasses import replace

import numpy as np
import pytest
from retraction_cases import COARSE_GRADING, SMALL_BLOCK, follow, straight_pull

from estimator.errors import InputError
from estimator.experiment import Box, Experiment, Grasp
from estimator.fem.equilibrium.observation import observe
from estimator.forward.meshing import mesh_experiment
from estimator.materials import NeoHookean
from estimator.materials.material import Material

LENGTH, WIDTH, HEIGHT = SMALL_BLOCK.phantom.size_m
TISSUE = Material(NeoHookean(), 10e3, 0.3)


def glued(lower: float, upper: float) -> Experiment:
    box = Box((lower, -WIDTH / 2, -HEIGHT / 2), (upper, WIDTH / 2, HEIGHT / 2))
    return replace(SMALL_BLOCK, grasp=Grasp(box, (LENGTH / 2, 0.0, 0.0)))


@pytest.mark.parametrize("depth", [0.0, 2e-5])
def test_a_plate_on_the_end_pulls_as_on_a_bar(depth: float) -> None:
    plate = glued(LENGTH / 2 - depth, LENGTH / 2 + 1e-4)
    problem = mesh_experiment(plate, COARSE_GRADING)
    assert np.allclose(problem.body.mesh.points[problem.gripped][:, 0], LENGTH / 2)
    assert np.isclose(problem.body.volume.sum(), LENGTH * WIDTH * HEIGHT)
    (state,) = follow(problem, TISSUE, straight_pull(plate, 6e-4, 1))
    # Both ends are kept from narrowing, which makes a bar of this slenderness a few per cent stiffer.
    bar = TISSUE.youngs_modulus * WIDTH * HEIGHT * 6e-4 / LENGTH
    assert observe(problem, state).wrench[0] == pytest.approx(-bar, rel=0.06)


def test_a_grasp_that_holds_all_of_the_body_is_refused() -> None:
    with pytest.raises(InputError, match="but not all of it"):
        mesh_experiment(glued(-LENGTH, LENGTH), COARSE_GRADING)
