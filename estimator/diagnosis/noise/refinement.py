"""The mesh on which hypotheses are solved, the finer one that its error is measured on, and how much that leaves.

Of an error that falls with the power p of the size of the elements, a mesh r times as fine leaves

    1 / (r^p - 1)

of what it changes (L. F. Richardson, Phil. Trans. R. Soc. A 210 (1911) 307). Where tissue is held strains are singular
on the rim, as the root of the distance from it; forces and beads away from it then converge with p = 1, those beside it
with less. What is left was learnt on blocks, whose meshes are 4 times as fine on that rim: a share s of 0.3 there goes
with p = ln(1 + 1 / s) / ln 4 = 1.06. On other meshes the share follows from this p and their r.

A block is meshed anew, with hexahedra of other sizes; the tetrahedra of an organ are each cut into eight, and r is 2
everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.block_mesh import Grading
from estimator.forward.finer import finer_mesh
from estimator.forward.gradings import FINE_GRADING, GRASP, SURFACE_GRADING, edge_lengths
from estimator.forward.meshing import mesh_experiment
from estimator.surfaces.reading import read_surface
from estimator.surfaces.units import Unit

# A third of the default's cost; what it misses is corrected for at the fitted baseline.
GRADING = Grading(grasp_m=2e-3, anchor_m=6e-3, largest_m=15e-3, growth=2.5, layers=1)


@dataclass(frozen=True, slots=True)
class Refinement:
    """A mesh and the finer one that its error is measured on.

    Attributes
    ----------
    rim_m : length of the elements on the rim of the grasp, m
    finer_rim_m : that of the finer mesh's
    """

    rim_m: float
    finer_rim_m: float

    @property
    def ratio(self) -> float:
        """How many times as fine the finer mesh is."""
        return self.rim_m / self.finer_rim_m

    def share_left(self, of_block: float) -> float:
        """Return the share of its correction that the finer mesh leaves, from that which a block's leaves."""
        order = np.log1p(1.0 / of_block) / np.log(OF_BLOCKS.ratio)
        return float(1.0 / np.expm1(order * np.log(self.ratio)))


OF_BLOCKS = Refinement(GRADING.grasp_m, FINE_GRADING.grasp_m)
"""That of the meshes of blocks."""


def grading_of(experiment: Experiment) -> Grading:
    """Return the grading of the mesh on which hypotheses about an experiment's phantom are solved."""
    return GRADING if experiment.phantom.surface is None else SURFACE_GRADING


def solved_on(experiment: Experiment) -> RetractionProblem:
    """Pose an experiment's retraction on the mesh on which hypotheses are solved.

    Raises
    ------
    InputError
        The phantom cannot be meshed.
    """
    return mesh_experiment(experiment, grading_of(experiment))


def measured_on(experiment: Experiment) -> RetractionProblem:
    """Pose it on the finer mesh, on which the error of the former is measured; errors as there."""
    return finer_mesh(experiment, grading_of(experiment), FINE_GRADING)


def refinement_of(experiment: Experiment) -> Refinement:
    """Return how fine the two meshes of an experiment's phantom are.

    Raises
    ------
    InputError
        Its surface cannot be read.
    """
    phantom = experiment.phantom
    return OF_BLOCKS if phantom.surface is None else _of_halves(phantom.surface, phantom.unit)


def _of_halves(file: Path, unit: Unit | None) -> Refinement:
    lengths = edge_lengths(read_surface(file, unit).surface, [GRASP], SURFACE_GRADING)
    return Refinement(lengths.rims_m[GRASP], lengths.rims_m[GRASP] / 2)
