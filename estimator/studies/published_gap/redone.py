"""A published table's experiments redone with the leading model acting: estimated its way and ours, side by side.

The sensors carry noise here, as the emulated rig's do. Our way is that of ``retract estimate``: quadratic elements, the
likelihood, the discretisation measured; it does not know the cause either.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from estimator.fit.estimate import estimate
from estimator.materials import NeoHookean
from estimator.materials.material import Material
from estimator.simulation.acting import read_effect
from estimator.simulation.simulate import Resolution, simulate_case
from estimator.studies.paper_tables.fitting import row_of
from estimator.studies.published_gap.diagnosis import GapDiagnosis
from estimator.studies.published_gap.paper_estimator import Readings
from estimator.studies.published_gap.pattern_fit import PatternResult
from estimator.studies.published_gap.published import PublishedEstimate
from estimator.studies.published_gap.retractions import ANCHORINGS, MOTION_NAMES, Anchoring, SetUp, mounting
from estimator.studies.published_gap.simulated import GRADING, USUAL_RATIO, Values, written
from estimator.studies.published_gap.simulations import CONDITIONS
from estimator.studies.running.arrays import as_text, from_text
from estimator.studies.running.campaign import Progress, run_cases
from estimator.studies.running.case import Parametric, Row
from estimator.studies.running.store import OutcomeStore
from estimator.studies.tables.telling import NONE, aligned
from estimator.workers import Workers

REDONE_HEAD = (
    "material",
    "anchored",
    "motion",
    "tissue's E, kPa",
    "published",
    "the paper's way",
    "ours",
    "ν published",
    "the paper's way",
    "ours",
)


@dataclass(frozen=True)
class RedoneMounting(Parametric):
    """The three retractions of a material under an anchoring, with effects acting, estimated our way one by one."""

    set_up: SetUp
    anchoring: Anchoring
    youngs_modulus: float
    effects: tuple[tuple[str, Values], ...]
    seed: int

    @property
    def name(self) -> str:
        """What is redone."""
        return f"redone at {self.youngs_modulus / 1e3:.2f} kPa, {self.anchoring.replace('_', ' ')} anchored"

    def run(self) -> Row:
        """Retract and estimate."""
        acting = [
            read_effect(",".join([name, *(f"{parameter}={value!r}" for parameter, value in values)]))
            for name, values in self.effects
        ]
        tissue = Material(NeoHookean(), self.youngs_modulus, USUAL_RATIO)
        planned = mounting(self.set_up, self.anchoring)
        seen = simulate_case(planned, tissue, self.seed, acting, resolution=Resolution(GRADING, "hex27"))
        row: dict[str, float | str] = {}
        for one in seen:
            row[f"{one.name} moved"] = as_text(one.fiducials[1:] - one.fiducials[0])
            row[f"{one.name} force"] = as_text(one.wrench[1:, :3] - one.wrench[0, :3])
            found = row_of(estimate([replace(one, order=1)]))
            row |= {f"{one.name} {name}": value for name, value in found.items()}
        return row


@dataclass(frozen=True)
class Redone:
    """One experiment redone; E in Pa. NaN where there is no estimate."""

    published: PublishedEstimate
    tissue_pa: float
    paper: tuple[float, float]
    ours: tuple[float, float]


def redo_experiments(
    diagnosis: GapDiagnosis, store: OutcomeStore, workers: Workers, progress: Progress
) -> list[Redone]:
    """Redo every row of the table with the leading model's causes at their median sizes."""
    result, table = diagnosis.ranking.leading, diagnosis.table
    moduli = np.median(result.model.true_modulus(result.draws), axis=0)
    cases: dict[tuple[int, int], RedoneMounting] = {}
    for material, modulus in enumerate(moduli):
        for place, anchoring in enumerate(ANCHORINGS):
            seed = material * len(ANCHORINGS) + place
            # Three digits say all that is known, and let what was stored be found again.
            stated = float(f"{modulus:.3g}")
            cases[material, place] = RedoneMounting(
                table.set_up, anchoring, stated, acting_at(result, stated), seed
            )
    outcomes = run_cases(list(cases.values()), store, workers, progress)
    rows = dict(zip(cases, (outcome.row for outcome in outcomes), strict=True))
    redone = []
    for one, material, condition in zip(table.estimates, table.material_of, table.condition_of, strict=True):
        place, motion = int(condition) // len(MOTION_NAMES), CONDITIONS[condition][1]
        row = rows[int(material), place]
        tissue = cases[int(material), place].youngs_modulus
        if row is None:
            redone.append(Redone(one, tissue, (np.nan, np.nan), (np.nan, np.nan)))
            continue
        steps = table.set_up.steps
        readings = Readings(
            from_text(str(row[f"{motion} moved"]), (1, steps, -1, 3)),
            from_text(str(row[f"{motion} force"]), (1, steps, 3)),
        )
        response = diagnosis.response
        modulus_found, ratio = response.tables[condition].estimate(readings, response.region)
        ours = float(row[f"{motion} youngs_modulus"]), float(row[f"{motion} poisson_ratio"])
        redone.append(Redone(one, tissue, (float(modulus_found[0]), float(ratio[0])), ours))
    return redone


def acting_at(result: PatternResult, modulus_pa: float) -> tuple[tuple[str, Values], ...]:
    """Return a model's effects at their median sizes, in tissue of a modulus, within what was simulated."""
    values = result.model.size_values(result.draws)
    acting = []
    for cause in result.model.causes:
        if not cause.effect:
            continue
        sizes = {}
        for size in cause.sizes:
            median = np.array([np.median(values[f"{cause.name} {size.name}"])])
            at_reference = size.at_reference(median, np.array([modulus_pa]))
            sizes[size.name] = float(f"{float(size.in_tissue(at_reference, modulus_pa)[0]):.3g}")
        acting.append((cause.effect, written({**cause.constants, **sizes})))
    return tuple(acting)


def redone_rows(redone: Sequence[Redone]) -> list[list[str]]:
    """Return the cells below :data:`REDONE_HEAD`."""
    return [
        [
            one.published.material,
            one.published.anchoring.replace("_", " "),
            one.published.motion.replace("_", " "),
            f"{one.tissue_pa / 1e3:.2f}",
            f"{one.published.youngs_modulus_pa / 1e3:.2f}",
            *(_cell(pair[0] / 1e3, ".2f") for pair in (one.paper, one.ours)),
            f"{one.published.poisson_ratio:.3f}",
            *(_cell(pair[1], ".3f") for pair in (one.paper, one.ours)),
        ]
        for one in redone
    ]


def redone_text(redone: Sequence[Redone]) -> str:
    """Return the table as text."""
    title = "the experiments redone with the leading model acting"
    return "\n".join([title, *aligned([list(REDONE_HEAD), *redone_rows(redone)])])


def redone_json(redone: Sequence[Redone]) -> list[dict[str, Any]]:
    """Return the table as JSON, in SI units."""
    return [
        {
            "material": one.published.material,
            "anchoring": one.published.anchoring,
            "motion": one.published.motion,
            "tissue_pa": one.tissue_pa,
            "paper": [None if np.isnan(value) else value for value in one.paper],
            "ours": [None if np.isnan(value) else value for value in one.ours],
        }
        for one in redone
    ]


def _cell(value: float, form: str) -> str:
    return NONE if np.isnan(value) else f"{value:{form}}"
