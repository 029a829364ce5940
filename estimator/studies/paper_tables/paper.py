"""What the paper gives, as far as it is known to this project; what is not known is None, never guessed.

Young's modulus as a change against the truth, times in seconds. The ranges of the silicones are those over the
trajectories and repeats of its tables VI and VII.
"""

from dataclasses import dataclass

from estimator.studies.tables.study import PaperFigure

# Section IV-A: 3563 and 13464 linear tetrahedra. The estimation with the finer model took the longer.
LOW_DENSITY = PaperFigure(seconds=773.0)
HIGH_DENSITY = PaperFigure(seconds=2452.0)

# By the height of the relief.
ROUGH_SURFACE = {
    0.02: PaperFigure(change=0.13),
    0.04: PaperFigure(change=0.29),
    0.08: PaperFigure(change=0.60),
}

# By the error of the grasp, m.
GRASP_ERROR = {5e-3: PaperFigure(change=-0.08, scatter=0.12)}


@dataclass(frozen=True, slots=True)
class Silicone:
    """A mixture of Ecoflex 00-30 with thinner: E by the tensile test, mean and deviation; ranges from retractions."""

    parts: str
    tensile_pa: tuple[float, float]
    youngs_modulus_pa: tuple[float, float]
    poisson_ratio: tuple[float, float]


SILICONES = (
    Silicone("1:1:0", (36.21e3, 2.62e3), (25.0e3, 27.1e3), (0.28, 0.42)),
    Silicone("1:1:1", (10.91e3, 1.54e3), (7.8e3, 10.6e3), (0.26, 0.35)),
    Silicone("1:1:2", (5.29e3, 1.92e3), (3.9e3, 4.5e3), (0.16, 0.40)),
)
