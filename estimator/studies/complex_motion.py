"""Table V: the complex motions, alone and together."""

from dataclasses import dataclass
from functools import cache

from estimator.experiment import Experiment
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fit.settings import Objective
from estimator.forward.meshing import DEFAULT_GRADING, mesh_experiment
from estimator.simulation.simulate import TRUE_RESOLUTION, Resolution
from estimator.studies.block import MOTIONS, POISSON_RATIO, YOUNGS_MODULUS, block, measured
from estimator.studies.case import Parametric, Row
from estimator.studies.fitting import fitted, row_of
from estimator.studies.objectives import OBJECTIVES
from estimator.studies.study import Group, Level, Study, Truth


@dataclass(frozen=True)
class ComplexMotion(Parametric):
    """One estimate from one retraction or several."""

    motions: tuple[str, ...]
    objective: Objective
    truth: Resolution = TRUE_RESOLUTION
    grading: Grading = DEFAULT_GRADING

    @property
    def name(self) -> str:
        """Which motions."""
        return f"{_words(self.motions)}, {self.objective}"

    def run(self) -> Row:
        """Retract on the true mesh and estimate with the model's."""
        seen = [_seen(motion, self.truth) for motion in self.motions]
        found = fitted(mesh_experiment(seen[0], self.grading), seen, self.objective)
        return row_of(found)


@cache
def _seen(motion: str, truth: Resolution) -> Experiment:
    """Return what perfect sensors read of a motion; several cases of a process estimate from it."""
    planned = block(MOTIONS[motion].poses())
    return measured(planned, mesh_experiment(planned, truth.grading, truth.kind))


def complex_motion(truth: Resolution = TRUE_RESOLUTION, grading: Grading = DEFAULT_GRADING) -> Study:
    """Return the study."""
    choices = [*((motion,) for motion in MOTIONS), tuple(MOTIONS)]
    groups = tuple(
        Group(
            words,
            tuple(
                Level(_words(motions), (ComplexMotion(motions, objective, truth, grading),))
                for motions in choices
            ),
            Truth(YOUNGS_MODULUS, POISSON_RATIO),
        )
        for objective, words in OBJECTIVES.items()
    )
    return Study(
        "table5",
        "Table V: complex motions",
        (
            "Data without noise from the converged mesh, estimates on the default mesh as it is: what they are off by "
            "is the discretisation's part. The paper gives no angles; these motions turn to 30° and 45°.",
        ),
        groups,
    )


def _words(motions: tuple[str, ...]) -> str:
    return "all three" if len(motions) > 1 else motions[0].replace("_", " ")
