"""The three retractions of one mounting with an effect acting, on our own converged model of a silicone.

Neo-Hookean tissue scales: without effects that carry a force or a compliance of their own, displacements do not depend
on E, and forces are proportional to it. With such an effect they depend on it only through products (compliance × E,
weight ÷ E), so that every simulation is made at one modulus, :data:`REFERENCE_PA`, with the values scaled to it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.fem.discretisation.block_mesh import Grading
from estimator.materials import NeoHookean
from estimator.materials.material import Material
from estimator.simulation.acting import read_effect
from estimator.simulation.simulate import Resolution, exact_readings
from estimator.studies.published_gap.paper_estimator import Readings
from estimator.studies.published_gap.retractions import MOTION_NAMES, Anchoring, SetUp, mounting, retraction
from estimator.studies.running.arrays import as_text, from_text
from estimator.studies.running.case import Parametric, Row

REFERENCE_PA = 5e3
USUAL_RATIO = 0.499
# Quadratic hexahedra: what the paper's estimator makes of their data is within 0.4 % in E and 0.002 in ν of what it
# makes of a mesh with half these sizes.
GRADING = Grading(grasp_m=1.5e-3, anchor_m=3e-3, largest_m=15e-3, growth=2.5, layers=1)
# How much farther a phantom was drawn before, where its memory matters.
_CONDITIONING = 1.5

Values = tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class SimulatedMounting(Parametric):
    """What perfect sensors read of a mounting's retractions.

    Attributes
    ----------
    effects : names with the values of their parameters, at the reference modulus
    conditioned : whether the phantom was drawn half as far again before the first retraction
    """

    set_up: SetUp
    anchoring: Anchoring
    effects: tuple[tuple[str, Values], ...] = ()
    poisson_ratio: float = USUAL_RATIO
    conditioned: bool = False
    grading: Grading = GRADING

    @property
    def name(self) -> str:
        """What acts."""
        acting = ", ".join(
            f"{name} {' '.join(f'{parameter} {value:g}' for parameter, value in values)}"
            for name, values in self.effects
        )
        return f"{acting or 'nothing acts'}, {self.anchoring.replace('_', ' ')} anchored"

    def run(self) -> Row:
        """Simulate the retractions."""
        planned = mounting(self.set_up, self.anchoring)
        if self.conditioned:
            farther = replace(self.set_up, way_m=_CONDITIONING * self.set_up.way_m)
            first = replace(retraction(farther, self.anchoring, "pull"), name="conditioning")
            planned = [first, *(replace(one, order=one.order + 1) for one in planned)]
        acting = [
            read_effect(",".join([name, *(f"{parameter}={value!r}" for parameter, value in values)]))
            for name, values in self.effects
        ]
        tissue = Material(NeoHookean(), REFERENCE_PA, self.poisson_ratio)
        seen = exact_readings(planned, tissue, acting, resolution=Resolution(self.grading, "hex27"))
        row: dict[str, float | str] = {}
        for one, readings in zip(planned[-len(MOTION_NAMES) :], seen[-len(MOTION_NAMES) :], strict=True):
            row[f"{one.name} moved"] = as_text(readings.fiducials[1:] - readings.fiducials[0])
            row[f"{one.name} force"] = as_text(readings.wrench[1:, :3] - readings.wrench[0, :3])
        return row

    def readings(self, row: Row) -> list[Readings]:
        """Return what :meth:`run` found, for each motion with one leading axis of length one."""
        steps = self.set_up.steps
        return [
            Readings(
                from_text(str(row[f"{name} moved"]), (1, steps, -1, 3)),
                from_text(str(row[f"{name} force"]), (1, steps, 3)),
            )
            for name in MOTION_NAMES
        ]


def written(values: Mapping[str, float]) -> Values:
    """Return values in an order that does not depend on how they were given."""
    return tuple(sorted((name, float(value)) for name, value in values.items()))


def stacked(readings: Sequence[Readings]) -> Readings:
    """Return several readings of one retraction along their leading axis."""
    return Readings(
        np.concatenate([one.moved for one in readings]), np.concatenate([one.force for one in readings])
    )
