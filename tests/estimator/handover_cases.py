"""What was found of small phantoms, for the tests of handovers."""

from collections.abc import Sequence

import numpy as np

from estimator import Experiment
from estimator.diagnosis.result import Quantity
from estimator.fem.discretisation.block_mesh import Grading
from estimator.handover.found import Answer, Cause, Found, Tissue
from estimator.handover.model import Able, HandedOver, hand_over
from estimator.simulation.acting import read_effect

COARSE = Grading(grasp_m=6e-3, anchor_m=10e-3, largest_m=20e-3, growth=3.0, layers=1)


def a_pull(way_m: float = 0.01, steps: int = 3, turn_rad: float = 0.0) -> Experiment:
    way = np.linspace((0.0, 0.0, 0.0), (way_m, 0.0, 0.0), steps)
    turn = np.linspace((0.0, 0.0, 0.0), (turn_rad, 0.0, 0.0), steps)
    return Experiment.of_block(way, turn, name="pull")


def tissue(poisson_ratio: float = 0.45, correlation: float = 0.0) -> Tissue:
    return Tissue(Quantity(15e3, 200.0, "Pa"), Quantity(poisson_ratio, 0.01, "1"), correlation)


def found_with(*effects: str, poisson_ratio: float = 0.45) -> Found:
    """The answer with these effects, as ``retract simulate --effect`` writes them."""
    acting = [read_effect(effect) for effect in effects]
    causes = tuple(Cause(one.effect, one.values, {}) for one in acting)
    label = acting[0].effect.label if acting else "none"
    return Found("neo_hookean", (), (Answer(label, 1.0, causes, tissue(poisson_ratio)),))


def handed_to(
    engine: Able, *effects: str, experiments: Sequence[Experiment] = (), grading: Grading = COARSE
) -> HandedOver:
    planned = experiments or [a_pull()]
    return hand_over(found_with(*effects), planned, engine, grading, lambda stage, done, total: None)
