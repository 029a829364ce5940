"""Where the gap lies: by block of the rig, by channel, and by experiment and phase."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from estimator.diagnosis.result import Where
from estimator.report.diagnosis.quantities import percent, words_of
from estimator.report.theme import INK, LINE, MEASURED, PREDICTED

_MOST_ROWS = 10
_ROW_IN = 0.27
_MARGIN_IN = 0.75


def where_height_in(where: Where) -> float:
    """Return how high the figure has to be, inches."""
    return _MARGIN_IN + _ROW_IN * max(map(_rows, (where.blocks, where.channels, where.steps)))


def draw_where(sheet: Figure, where: Where) -> None:
    """Draw the probability of each block of the rig, and what share of the gap each channel and phase has."""
    height = where_height_in(where)
    panels = (
        ("block of the rig, probability", where.blocks),
        ("channel, share of the gap", where.channels),
        ("phase, share of the gap", where.steps),
    )
    for (title, shares), left, width in zip(panels, (0.07, 0.38, 0.8), (0.18, 0.15, 0.15), strict=True):
        tall = _ROW_IN * _rows(shares) / height
        axes = sheet.add_axes((left, 1 - 0.4 / height - tall, width, tall))
        axes.set_title(title)
        _bars(axes, shares)


def _rows(shares: Mapping[str, float]) -> int:
    return max(1, min(len(shares), _MOST_ROWS))


def _bars(axes: Axes, shares: Mapping[str, float]) -> None:
    largest = sorted(shares.items(), key=lambda item: -item[1])[:_MOST_ROWS]
    places = np.arange(len(largest))
    values = [share for _, share in largest]
    axes.barh(places, np.ones(len(largest)), 0.7, color=LINE, alpha=0.5)
    axes.barh(places, values, 0.7, color=[PREDICTED, *[MEASURED] * (len(largest) - 1)][: len(largest)])
    for place, share in enumerate(values):
        axes.annotate(
            percent(share),
            (1.03, place),
            xycoords=("axes fraction", "data"),
            va="center",
            color=INK,
            fontsize=9,
            annotation_clip=False,
        )
    axes.set_yticks(places, [words_of(name) for name, _ in largest])
    axes.set_ylim(_rows(shares) - 0.5, -0.5)
    axes.set_xlim(0, 1)
    axes.set_xticks([])
    axes.grid(visible=False)
    axes.spines[["left", "bottom"]].set_visible(False)
    axes.tick_params(axis="y", length=0)
