"""Small multiples of a study: E above, ν below, a column for each group, a mark for each case."""

import textwrap

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from estimator.report.theme import ANCHOR, MEASURED, PREDICTED, TRUTH
from estimator.studies.tables.study import GroupResult, StudyResult

FloatArray = NDArray[np.float64]

COLUMN_IN, HEIGHT_IN = 3.7, 5.2
# Draws stand side by side within this part of their level's width.
_SPREAD = 0.5
_PAPER_MARK = 0.36
# Of all labels along an axis, so that they do not run into each other.
_LABEL_CHARACTERS = 44
_TITLE_CHARACTERS = 40


def figure_size(result: StudyResult) -> tuple[float, float]:
    """Return width and height, inches."""
    return max(2, len(result.groups)) * COLUMN_IN, HEIGHT_IN


def draw_study(sheet: Figure, result: StudyResult) -> None:
    """Draw every case as a mark, mean and standard deviation as a bar, the truth as a line, the paper as diamonds."""
    panels = sheet.subplots(2, len(result.groups), squeeze=False, sharey="row", sharex="col")
    sheet.subplots_adjust(left=0.115, right=0.985, bottom=0.14, top=0.85, wspace=0.08, hspace=0.1)
    for column, group in enumerate(result.groups):
        modulus, ratio = panels[:, column]
        truth = group.group.truth
        _draw_levels(modulus, [level.youngs_modulus / 1e3 for level in group.levels])
        _draw_levels(ratio, [level.poisson_ratio for level in group.levels])
        if truth is not None:
            modulus.axhline(truth.youngs_modulus / 1e3, color=TRUTH, linestyle=(0, (5, 3)), label="truth")
            ratio.axhline(truth.poisson_ratio, color=TRUTH, linestyle=(0, (5, 3)))
        _draw_paper(modulus, group, "youngs_modulus", 1e-3)
        _draw_paper(ratio, group, "poisson_ratio", 1.0)
        modulus.set_title(textwrap.fill(group.group.title, _TITLE_CHARACTERS), fontsize=9)
        ratio.set_xticks(
            np.arange(len(group.levels)),
            [textwrap.fill(level.level.label, _label_characters(group)) for level in group.levels],
            fontsize=8,
        )
        ratio.set_xlim(-0.6, len(group.levels) - 0.4)
    panels[0, 0].set_ylabel("Young's modulus E, kPa")
    panels[1, 0].set_ylabel("Poisson's ratio ν")
    entries: dict[str, Artist] = {}
    for axes in panels[0]:
        handles, labels = axes.get_legend_handles_labels()
        entries |= dict(zip(labels, handles, strict=True))
    sheet.legend(
        list(entries.values()), list(entries), loc="upper right", ncols=len(entries), borderaxespad=0.3
    )


def _label_characters(group: GroupResult) -> int:
    return max(7, _LABEL_CHARACTERS // len(group.levels))


def _draw_levels(axes: Axes, levels: list[FloatArray]) -> None:
    for place, values in enumerate(levels):
        if not len(values):
            continue
        sides = (
            _SPREAD * (np.arange(len(values)) / max(1, len(values) - 1) - 0.5) if len(values) > 1 else [0.0]
        )
        label = "estimate" if place == 0 else None
        axes.plot(
            place + np.asarray(sides), values, "o", color=MEASURED, markersize=4, alpha=0.7, label=label
        )
        if len(values) > 1:
            label = "mean ± deviation" if place == 0 else None
            spread = values.std(ddof=1)
            axes.errorbar(
                [place], [values.mean()], [spread], fmt="_", color=PREDICTED, capsize=4, label=label, zorder=3
            )


def _draw_paper(axes: Axes, group: GroupResult, name: str, unit: float) -> None:
    label: str | None = "the paper's mean"
    for place, level in enumerate(group.levels):
        figure = level.level.paper
        if figure is None:
            continue
        mean = figure.youngs_modulus_pa if name == "youngs_modulus" else figure.poisson_ratio
        spread = figure.scatter.get(name)
        error = None if spread is None else [unit * mean * spread]
        at = [place + _PAPER_MARK]
        axes.errorbar(at, [unit * mean], error, fmt="D", color=ANCHOR, markersize=5, capsize=3, label=label)
        label = None
