"""Table II: a phantom with a rough top, which the model takes for a smooth block."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimator.forward.meshing import mesh_experiment
from estimator.geometry.rough import raised_block
from estimator.studies.paper_tables.block import (
    MOTIONS,
    POISSON_RATIO,
    SIZE_M,
    YOUNGS_MODULUS,
    block,
    measured,
)
from estimator.studies.paper_tables.densities import raised, response_on
from estimator.studies.paper_tables.figures import TABLE_II
from estimator.studies.paper_tables.fitting import fitted, row_of
from estimator.studies.paper_tables.grasp_error import Way
from estimator.studies.paper_tables.paper_method import estimate_by_paper
from estimator.studies.running.case import Parametric, Row
from estimator.studies.tables.study import Group, Level, Study, Truth

FloatArray = NDArray[np.float64]

# What the height scale is a share of: the thickness, as the paper's text has it; the longer edge; or the diagonal of
# the bounding box, as MeshLab's percentages are.
Reference = Literal["thickness", "edge", "diagonal"]
_REFERENCE_M: dict[Reference, float] = {
    "thickness": SIZE_M[2],
    "edge": SIZE_M[0],
    "diagonal": float(np.linalg.norm(SIZE_M)),
}
# Squares of the relief along the edges.
CELLS = (60, 60, 2)


@dataclass(frozen=True)
class RoughSurface(Parametric):
    """One Pull of a rough block, estimated with a smooth one."""

    reference: Reference
    height: float
    seed: int
    way: Way = "paper"

    @property
    def name(self) -> str:
        """What was drawn."""
        return f"relief of {100 * self.height:g} % of the {self.reference}, seed {self.seed}, {self.way}"

    def run(self) -> Row:
        """Retract the rough block on the high density and estimate with the smooth low one, or with our element."""
        smooth = block(MOTIONS["pull"].poses())
        relief = Relief.drawn(self.height * _REFERENCE_M[self.reference], self.seed)
        true = raised(smooth, "high", relief)
        seen = measured(replace(smooth, fiducials_rest=true.fiducials_rest), true)
        # What is compared is how far the beads have moved: a smooth block has them elsewhere.
        moved = replace(
            smooth,
            wrench=seen.wrench,
            fiducials=seen.fiducials - true.fiducials_rest + smooth.fiducials_rest,
        )
        remark = f"mean thickness {100 * relief.mean_m / SIZE_M[2]:+.0f} %"
        if self.way == "paper":
            return estimate_by_paper([response_on("low", "pull")], [moved]).row(remark=remark)
        return row_of(fitted(mesh_experiment(smooth), [moved]), remark=remark)


@dataclass(frozen=True, eq=False)
class Relief:
    """Heights on a grid over the block's top, m; between its points they are interpolated."""

    along: FloatArray
    heights: FloatArray

    @staticmethod
    def drawn(height_m: float, seed: int, cells: tuple[int, int, int] = CELLS) -> "Relief":
        """Return a ridged multifractal that stands on the block and is so high, m."""
        surface = raised_block(SIZE_M, height_m, seed, cells)
        along = np.linspace(-SIZE_M[0] / 2, SIZE_M[0] / 2, cells[0] + 1)
        heights = np.zeros((len(along), len(along)))
        places = np.rint((surface.vertices[:, :2] / SIZE_M[0] + 0.5) * cells[0]).astype(int)
        np.maximum.at(heights, (places[:, 0], places[:, 1]), surface.vertices[:, 2] - SIZE_M[2] / 2)
        return Relief(along, heights)

    @property
    def mean_m(self) -> float:
        """The mean height, m."""
        return float(self.heights.mean())

    def __call__(self, at: FloatArray) -> FloatArray:
        """Return heights (n,) at places (n, 2), m."""
        spacing = self.along[1] - self.along[0]
        number = np.clip(((at - self.along[0]) / spacing).astype(int), 0, len(self.along) - 2)
        u, v = ((at - self.along[number]) / spacing).T
        i, j = number.T
        low = (1 - u) * self.heights[i, j] + u * self.heights[i + 1, j]
        high = (1 - u) * self.heights[i, j + 1] + u * self.heights[i + 1, j + 1]
        return np.asarray((1 - v) * low + v * high)


def rough_surface(seeds: Sequence[int]) -> Study:
    """Return the study with these reliefs for each height."""
    truth = Truth(YOUNGS_MODULUS, POISSON_RATIO)

    def levels(reference: Reference, way: Way, drawn: Sequence[int]) -> tuple[Level, ...]:
        return tuple(
            Level(
                f"{100 * height:g} % of the {reference}",
                tuple(RoughSurface(reference, height, seed, way) for seed in drawn),
                figure,
            )
            for height, figure in TABLE_II.items()
        )

    return Study(
        "table2",
        "Table II: rough surfaces",
        (
            "A Pull of 10 × 2 mm without noise of a block on which a ridged multifractal stands, on the high density; "
            "estimated with the smooth block. What the height scale is a share of is read in three ways: the "
            "thickness, as the paper's text has it, the longer edge, and the diagonal of the bounding box, of which "
            "MeshLab's percentages are shares.",
        ),
        (
            Group("the paper's method, share of the diagonal", levels("diagonal", "paper", seeds), truth),
            Group("the paper's method, share of the edge", levels("edge", "paper", seeds), truth),
            Group(
                "the paper's method, share of the thickness", levels("thickness", "paper", seeds[:1]), truth
            ),
            Group(
                "our element and likelihood, share of the diagonal",
                levels("diagonal", "ours", seeds[:1]),
                truth,
            ),
        ),
    )
