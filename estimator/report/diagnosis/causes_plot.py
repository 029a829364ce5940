"""The ranking of causes: how probable each is, and how large."""

import textwrap
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from estimator.diagnosis.model.labels import NONE
from estimator.diagnosis.result import Diagnosis
from estimator.report.diagnosis.findings import answer_words, ranking, standing
from estimator.report.diagnosis.quantities import parameters_text
from estimator.report.theme import INK, LINE, MEASURED, MUTED, PREDICTED, TRUTH

_ROW_IN = 0.44
_MARGIN_IN = 0.75
_SIZE_CHARACTERS = 60
_SIZE_LINES = 2
_ANSWER_CHARACTERS = 26


def causes_height_in(diagnosis: Diagnosis) -> float:
    """Return how high the figure has to be, inches."""
    return _MARGIN_IN + _ROW_IN * len(ranking(diagnosis))


def draw_causes(sheet: Figure, diagnosis: Diagnosis) -> None:
    """Draw a bar for each likely answer, its size beside it; the verdict and the credible set are marked."""
    ranked = ranking(diagnosis)
    height = causes_height_in(diagnosis)
    axes = sheet.add_axes((0.2, 0.45 / height, 0.36, 1 - _MARGIN_IN / height))
    places = np.arange(len(ranked))
    verdict, accent = (diagnosis.verdict, PREDICTED) if diagnosis.verdict else ((NONE,), TRUTH)
    colours = [
        accent if label in verdict else MEASURED if label in diagnosis.credible_set else MUTED
        for label, _ in ranked
    ]
    axes.barh(places, np.ones(len(ranked)), 0.62, color=LINE, alpha=0.5)
    axes.barh(places, [probability for _, probability in ranked], 0.62, color=colours)
    for place, (label, _) in enumerate(ranked):
        finding = diagnosis.effects.get(label)
        size = "" if finding is None else parameters_text(finding)
        lines = textwrap.wrap(size, _SIZE_CHARACTERS, max_lines=_SIZE_LINES, placeholder=" …")
        style: dict[str, Any] = {
            "xycoords": ("axes fraction", "data"),
            "va": "center",
            "annotation_clip": False,
        }
        axes.annotate(standing(diagnosis, label), (1.015, place), color=INK, fontweight="bold", **style)
        axes.annotate("\n".join(lines), (1.18, place), color=MUTED, fontsize=9, **style)
    axes.set_yticks(places, [textwrap.fill(answer_words(label), _ANSWER_CHARACTERS) for label, _ in ranked])
    for tick, (label, _) in zip(axes.get_yticklabels(), ranked, strict=True):
        tick.set_fontweight("bold" if label in verdict else "normal")
    axes.set_ylim(len(ranked) - 0.5, -0.5)
    axes.set_xlim(0, 1)
    axes.set_xticks([0, 0.5, 1], ["0", "50 %", "100 %"])
    axes.grid(visible=False)
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="y", length=0)
