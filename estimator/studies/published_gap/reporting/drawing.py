"""The pattern drawn: published pairs, what models predict, and what the withheld half was predicted to be."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from estimator.report.theme import ANCHOR, GRASP, MEASURED, MUTED, PREDICTED, TRUTH
from estimator.studies.published_gap.diagnosis import GapDiagnosis
from estimator.studies.published_gap.pattern_fit import PatternResult
from estimator.studies.published_gap.simulations import CONDITIONS

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

COLUMN_IN, HEIGHT_IN = 3.4, 5.8
_SHORT = {"pull": "pull", "gradual_tangent_pull": "tangent", "twist_and_pull": "twist"}


def pattern_size(diagnosis: GapDiagnosis) -> tuple[float, float]:
    """Return width and height, inches."""
    return max(2, len(diagnosis.table.materials)) * COLUMN_IN, HEIGHT_IN


def draw_pattern(sheet: Figure, diagnosis: GapDiagnosis) -> None:
    """Draw E over the bench test's above and ν below, a column for each material.

    Hollow marks are predictions of rows that the model was neither chosen on nor learnt from: those of the anchoring
    that was withheld.
    """
    table, ranking = diagnosis.table, diagnosis.ranking
    panels = sheet.subplots(2, len(table.materials), squeeze=False, sharey="row", sharex=True)
    sheet.subplots_adjust(left=0.1, right=0.985, bottom=0.2, top=0.84, wspace=0.08, hspace=0.1)
    shown: list[tuple[PatternResult, str, str, str, float, BoolArray | None]] = [
        (ranking.best(0), "locking alone", TRUTH, "s", -0.24, None),
        (ranking.best(1), f"best single: {ranking.best(1).model.name}", ANCHOR, "^", -0.08, None),
        (ranking.best(2), f"best pair: {ranking.best(2).model.name}", PREDICTED, "D", 0.08, None),
    ]
    for part in diagnosis.withheld:
        if part.name in ("one side", "two sides"):
            best = part.ranking.leading
            label = f"predicted unseen: {best.model.name}, learnt on the other anchoring"
            shown.append((best, label, GRASP, "o", 0.24, part.rows))
    for column, material in enumerate(table.materials):
        rows = np.array([one.material == material for one in table.estimates])
        bench = table.bench[material]
        modulus, ratio = panels[:, column]
        spread = bench.std_pa / bench.youngs_modulus_pa
        modulus.axhspan(
            1 - spread, 1 + spread, color=MUTED, alpha=0.15, linewidth=0, label="bench test ± deviation"
        )
        places = table.condition_of[rows]
        published = np.exp(table.log_modulus[rows]) / bench.youngs_modulus_pa
        modulus.plot(
            places, published, "_", color=MEASURED, markersize=26, markeredgewidth=2.4, label="published"
        )
        ratio.plot(places, table.poisson_ratio[rows], "_", color=MEASURED, markersize=26, markeredgewidth=2.4)
        for result, label, colour, mark, shift, withheld in shown:
            chosen = rows if withheld is None else rows & withheld
            style = _Style(label, colour, mark, shift, hollow=withheld is not None)
            log, nu = result.means
            ratios = np.exp(log[:, chosen]) / bench.youngs_modulus_pa
            chosen_places = table.condition_of[chosen].astype(np.float64)
            _draw_predictions(modulus, chosen_places, ratios, style)
            _draw_predictions(ratio, chosen_places, nu[:, chosen], style)
        modulus.set_title(material)
        ratio.set_xticks(
            range(len(CONDITIONS)),
            [f"{_SHORT[motion]}\n{anchoring.replace('_', ' ')}" for anchoring, motion in CONDITIONS],
            fontsize=7.5,
            rotation=60,
        )
        ratio.set_xlim(-0.6, len(CONDITIONS) - 0.4)
    panels[0, 0].set_ylabel("E over the bench test's")
    panels[1, 0].set_ylabel("Poisson's ratio ν")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    sheet.legend(
        list(unique.values()), list(unique), loc="upper left", ncols=2, fontsize=8, borderaxespad=0.3
    )


@dataclass(frozen=True, slots=True)
class _Style:
    """How a model's predictions are drawn: beside the published value by ``shift`` of the way to the next condition."""

    label: str
    colour: str
    marker: str
    shift: float
    hollow: bool


def _draw_predictions(axes: Axes, places: FloatArray, values: FloatArray, style: _Style) -> None:
    """Draw draws of predictions (n, rows) as their median and the range of nine tenths of them."""
    low, middle, high = np.quantile(values, (0.05, 0.5, 0.95), axis=0)
    axes.errorbar(
        places + style.shift,
        middle,
        [middle - low, high - middle],
        fmt=style.marker,
        color=style.colour,
        markerfacecolor="none" if style.hollow else style.colour,
        markersize=4.5,
        elinewidth=0.9,
        label=style.label,
    )
