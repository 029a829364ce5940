"""The share of each source of uncertainty in the variance of each parameter, as bars."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from estimator.fit.budget.budget import Budget, Line
from estimator.report.theme import MEASURED, PREDICTED

_SHOWN = 5e-3
_BAR_IN, _AROUND_IN = 0.27, 0.9


def height_in(budget: Budget) -> float:
    """Return how high the figure is to be, inches."""
    return _AROUND_IN + _BAR_IN * len(_shown(budget))


def draw_budget(sheet: Figure, budget: Budget) -> None:
    """Draw the sources of half a per cent or more, the largest on top."""
    lines = _shown(budget)
    height = sheet.get_figheight()
    all_axes = sheet.subplots(1, len(budget.symbols), sharey=True, squeeze=False)[0]
    sheet.subplots_adjust(left=0.27, right=0.98, bottom=0.5 / height, top=1 - 0.4 / height, wspace=0.08)
    places = np.arange(len(lines))[::-1]
    for axes, (name, symbol) in zip(all_axes, budget.symbols.items(), strict=True):
        shares = [100 * line.share[name] for line in lines]
        colours = [MEASURED if line.source.known else PREDICTED for line in lines]
        axes.barh(places, shares, height=0.7, color=colours)
        for place, share in zip(places, shares, strict=True):
            axes.annotate(f"{share:.1f}", (share, place), (3, 0), textcoords="offset points", va="center")
        axes.set_xlim(0, 1.12 * max(*shares, 1.0))
        axes.set_xlabel(f"share in the variance of {symbol}, %")
        axes.grid(visible=False, axis="y")
    all_axes[0].set_yticks(places, [line.source.words for line in lines])
    handles = [
        Patch(color=MEASURED, label="the fit knows of it"),
        Patch(color=PREDICTED, label="comes on top"),
    ]
    sheet.legend(handles=handles, loc="upper right", ncols=2, borderaxespad=0.2)


def _shown(budget: Budget) -> list[Line]:
    return [line for line in budget.lines if max(line.share.values()) >= _SHOWN]
