"""Which simulations the learnt map needs: of each candidate over the grid of its sizes, and those it is checked on."""

import itertools
from collections.abc import Sequence

from estimator.studies.published_gap.candidate import Candidate
from estimator.studies.published_gap.paper_estimator import (
    LOW_DENSITY_CELLS,
    LowDensityResponse,
)
from estimator.studies.published_gap.retractions import ANCHORINGS, MOTION_NAMES, SetUp
from estimator.studies.published_gap.simulated import USUAL_RATIO, SimulatedMounting
from estimator.studies.running.case import Case

# The tissue's own ν, which nobody measured: nearly incompressible.
TISSUE_RATIOS = (0.495, USUAL_RATIO, 0.4999)
CONDITIONS = tuple((anchoring, motion) for anchoring in ANCHORINGS for motion in MOTION_NAMES)


def learning_cases(
    set_up: SetUp, candidates: Sequence[Candidate], cells: tuple[int, int, int] = LOW_DENSITY_CELLS
) -> list[Case]:
    """Return all simulations that the map is learnt from, and those that it is checked on."""
    cases: list[Case] = [
        LowDensityResponse(set_up, anchoring, motion, cells) for anchoring, motion in CONDITIONS
    ]
    cases += [
        SimulatedMounting(set_up, anchoring, poisson_ratio=ratio)
        for ratio in TISSUE_RATIOS
        for anchoring in ANCHORINGS
    ]
    for candidate in candidates:
        if candidate.effect:
            cases += [candidate.undisturbed(set_up, anchoring) for anchoring in ANCHORINGS]
            for at in [*grid_of(candidate), *candidate.checks]:
                cases += [candidate.case(set_up, anchoring, at) for anchoring in ANCHORINGS]
    return cases


def grid_of(candidate: Candidate) -> list[tuple[float, ...]]:
    """Return every combination of a candidate's sizes that is simulated."""
    return list(itertools.product(*(size.nodes for size in candidate.sizes)))


def pair_cases(
    set_up: SetUp, pair: Sequence[Candidate], at: Sequence[tuple[float, ...]]
) -> list[SimulatedMounting]:
    """Return the simulations of two causes at once, one for each anchoring."""
    cases = []
    for anchoring in ANCHORINGS:
        single = [one.case(set_up, anchoring, sizes) for one, sizes in zip(pair, at, strict=True)]
        effects = tuple(effect for case in single for effect in case.effects)
        conditioned = any(case.conditioned for case in single)
        cases.append(SimulatedMounting(set_up, anchoring, effects, USUAL_RATIO, conditioned))
    return cases
