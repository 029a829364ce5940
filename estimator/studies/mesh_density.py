"""Table I: the density of the mesh, of the data and of the model."""

from dataclasses import dataclass
from functools import cache
from typing import Literal

from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fit.settings import Objective
from estimator.forward.meshing import mesh_experiment
from estimator.simulation.simulate import TRUTH_GRADING
from estimator.studies import paper
from estimator.studies.block import MOTIONS, POISSON_RATIO, YOUNGS_MODULUS, block, measured
from estimator.studies.case import Parametric, Row
from estimator.studies.fitting import fitted, row_of
from estimator.studies.study import UNKNOWN, Group, Level, PaperFigure, Study, Truth
from estimator.studies.tetrahedra import block_of_tetrahedra

MeshName = Literal["low", "high", "default", "converged"]

# Cells of uniform meshes with about as many linear tetrahedra as the paper's: 3468 for 3563, 13824 for 13464.
CELLS: dict[str, tuple[int, int, int]] = {"low": (17, 17, 2), "high": (24, 24, 4)}
_WORDS: dict[MeshName, str] = {
    "low": "low density",
    "high": "high density",
    "default": "default mesh",
    "converged": "converged",
}


@dataclass(frozen=True)
class MeshDensity(Parametric):
    """One estimate from a Pull on one mesh with a model on another."""

    data: MeshName
    model: MeshName
    objective: Objective
    finer: MeshName | None = None

    @property
    def name(self) -> str:
        """What is estimated from what."""
        corrected = f" corrected on {_WORDS[self.finer]}" if self.finer else ""
        return f"{_WORDS[self.data]} data, {_WORDS[self.model]} model{corrected}"

    def run(self) -> Row:
        """Make the data and estimate from them."""
        experiment = _seen(self.data)
        model = posed(experiment, self.model)
        finer = posed(experiment, self.finer) if self.finer else None
        found = fitted(model, [experiment], self.objective, finer)
        return row_of(
            found,
            remark=f"{len(model.body.mesh.cells)} {model.body.mesh.kind}, {found.forward_solves} states solved",
        )


@cache
def _seen(mesh: MeshName) -> Experiment:
    """Return what perfect sensors read of a Pull on a mesh; several cases of a process estimate from it."""
    planned = block(MOTIONS["pull"].poses())
    return measured(planned, posed(planned, mesh))


def posed(experiment: Experiment, mesh: MeshName) -> RetractionProblem:
    """Pose the block's retraction on a mesh of that name."""
    if mesh in CELLS:
        return block_of_tetrahedra(experiment, CELLS[mesh])
    if mesh == "converged":
        return mesh_experiment(experiment, TRUTH_GRADING, "hex64")
    return mesh_experiment(experiment)


def mesh_density() -> Study:
    """Return the study."""
    truth = Truth(YOUNGS_MODULUS, POISSON_RATIO)
    same = (
        _level("high", "high", "paper", "case 1: high density", paper.HIGH_DENSITY),
        _level("high", "low", "paper", "case 2: low density", paper.LOW_DENSITY),
        _level("high", "low", "paper", "case 2, error measured on the high density", finer="high"),
        _level("high", "low", "likelihood", "the same by the likelihood", finer="high"),
    )
    converged = (
        _level("converged", "high", "paper", "high density"),
        _level("converged", "low", "paper", "low density"),
        _level("converged", "default", "paper", "default mesh"),
        _level("converged", "default", "likelihood", "default mesh, by the likelihood"),
    )
    return Study(
        "table1",
        "Table I: density of the mesh",
        (
            "A Pull of 10 × 2 mm without noise. Low and high density are uniform meshes with about as many linear "
            "tetrahedra as the paper's; the two cases are read as estimations with the one and with the other.",
            "Linear tetrahedra are too stiff at this ν: data from a mesh that locks as the model does hide it, data "
            "from the converged solution show what it does to E and ν on a real phantom.",
            "Where a line says so, the low density's error is measured on the high density at three states, and "
            "corrected for.",
            "Estimates by the paper's objective (eq. 1) with its scale factor (eq. 3), but where told otherwise.",
        ),
        (
            Group("data from the high-density mesh", same, truth),
            Group("data from the converged solution", converged, truth),
        ),
    )


def _level(
    data: MeshName,
    model: MeshName,
    objective: Objective,
    label: str,
    figure: PaperFigure = UNKNOWN,
    finer: MeshName | None = None,
) -> Level:
    return Level(label, (MeshDensity(data, model, objective, finer),), figure)
