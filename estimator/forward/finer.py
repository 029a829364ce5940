"""The finer mesh on which a mesh's error is measured.

A block is meshed anew with smaller hexahedra. No two runs of the mesher of surfaces agree, and one that is asked for
elements of half the size makes them three quarters as large, for they follow the skin: what such a mesh changes tells
little of what it leaves. So the tetrahedra of the mesh itself are each cut into eight: elements are half as long
everywhere, and what that changes is a refinement and nothing else.
"""

from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.block_mesh import Grading
from estimator.forward.gradings import MEASURING_GRADING, usual_grading
from estimator.forward.meshing import mesh_experiment, surface_problem
from estimator.geometry.mesh_cache import halved_mesh
from estimator.surfaces.reading import read_surface


def finer_mesh(experiment: Experiment, grading: Grading, of_block: Grading) -> RetractionProblem:
    """Pose an experiment's retraction on a mesh that is finer than that of a grading.

    Parameters
    ----------
    experiment : Experiment
    grading : of the mesh of a surface, which is halved
    of_block : the finer grading, of a block

    Raises
    ------
    InputError
        The phantom cannot be meshed.
    """
    phantom = experiment.phantom
    if phantom.surface is None:
        return mesh_experiment(experiment, of_block)
    surface = read_surface(phantom.surface, phantom.unit).surface
    return surface_problem(experiment, surface, grading, halved_mesh)


def measuring_mesh(experiment: Experiment) -> RetractionProblem:
    """Pose the retraction on the mesh that a fit measures its discretisation error on; errors as there."""
    return finer_mesh(experiment, usual_grading(experiment), MEASURING_GRADING)
