"""The mesh of an experiment, coarse or fine, and which of its nodes are held."""

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.experiment import Experiment
from estimator.fem.block_mesh import Grading, block_mesh, snapped_to_block
from estimator.fem.elements import ElementKind
from estimator.fem.problem import RetractionProblem, retraction_problem

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]

# On the paper's block, force within 0.2 % and fiducials within 20 µm of the converged solution.
DEFAULT_GRADING = Grading(grasp_m=1e-3, anchor_m=3e-3, largest_m=12e-3, growth=2.0, layers=1)
# About a third of the default's error: it measures the default's.
FINE_GRADING = Grading(grasp_m=0.5e-3, anchor_m=2e-3, largest_m=12e-3, growth=2.0, layers=2)


def mesh_experiment(
    experiment: Experiment, grading: Grading = DEFAULT_GRADING, kind: ElementKind = "hex27"
) -> RetractionProblem:
    """Mesh the phantom of an experiment and pose its retraction.

    Raises
    ------
    InputError
        The phantom is no block, or grasp or anchors hold no tissue.
    """
    if experiment.phantom.shape != "block":
        raise InputError(
            f"{experiment.name}: a phantom given as a surface cannot be meshed yet; give a block ([phantom] shape)"
        )
    half = np.asarray(experiment.phantom.size_m) / 2
    mesh = block_mesh(2 * half, experiment.anchors, experiment.grasp.box, grading, kind)
    fixed = np.zeros(len(mesh.points), dtype=bool)
    for anchor in experiment.anchors:
        fixed |= _inside(mesh.points, snapped_to_block(anchor, half))
    grasp = snapped_to_block(experiment.grasp.box, half)
    return retraction_problem(
        mesh,
        fixed,
        _inside(mesh.points, grasp),
        np.asarray(experiment.grasp.centre),
        experiment.fiducials_rest,
        _inside(experiment.fiducials_rest, grasp),
    )


def _inside(points: FloatArray, corners: FloatArray) -> BoolArray:
    margin = 1e-9
    return np.asarray(np.all((points > corners[0] - margin) & (points < corners[1] + margin), axis=1))
