"""The gap without and with the causes, and the floor of noise; and what E and ν were and become."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, ScalarFormatter

from estimator.diagnosis.result import Diagnosis, Gap, Quantity
from estimator.report.diagnosis.findings import gap_rows
from estimator.report.diagnosis.quantities import closure_text
from estimator.report.theme import INK, LINE, MUTED, PREDICTED, TRUTH

BEFORE, AFTER = PREDICTED, TRUTH

_TICKS = (0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
_INTERVAL_95 = 1.96


def draw_gap(sheet: Figure, diagnosis: Diagnosis) -> None:
    """Draw an arrow for each gap from before to after, the floor beside it, and E and ν on the right."""
    grid = sheet.add_gridspec(
        2, 2, width_ratios=[2.5, 1], left=0.13, right=0.985, bottom=0.13, top=0.86, wspace=0.52, hspace=1.1
    )
    rows = gap_rows(diagnosis)
    axes = sheet.add_subplot(grid[:, 0], xscale="log", xlabel="root mean square misfit, σ of the noise")
    _arrows(axes, rows)
    sheet.legend(*axes.get_legend_handles_labels(), loc="upper left", ncols=3, borderaxespad=0.2)
    _material(
        sheet.add_subplot(grid[0, 1], title="Young's modulus E, kPa"),
        [_scaled(m.youngs_modulus, 1e-3) for m in (diagnosis.before, diagnosis.after)],
    )
    _material(
        sheet.add_subplot(grid[1, 1], title="Poisson's ratio ν"),
        [m.poisson_ratio for m in (diagnosis.before, diagnosis.after)],
    )


def _arrows(axes: Axes, rows: Sequence[tuple[str, Gap]]) -> None:
    places = np.arange(len(rows))
    before, after, floor = (
        np.array([getattr(gap, name) for _, gap in rows]) for name in ("before", "after", "floor")
    )
    axes.plot(
        floor, places, "|", color=INK, markersize=15, markeredgewidth=1.6, label="noise alone", zorder=2
    )
    axes.plot(before, places, "o", color=BEFORE, markersize=8, label="before: baseline", zorder=3)
    axes.plot(after, places, "o", color=AFTER, markersize=8, label="after: causes in the model", zorder=4)
    for place, (_, gap) in zip(places, rows, strict=True):
        axes.annotate(
            "",
            (gap.after, place),
            (gap.before, place),
            arrowprops={"arrowstyle": "-|>", "color": MUTED, "linewidth": 1.4, "shrinkA": 4, "shrinkB": 4},
        )
        widened = gap.closure_held_out < 0
        axes.annotate(
            closure_text(gap.closure_held_out, gap.closure_std),
            (1.02, place),
            xycoords=("axes fraction", "data"),
            va="center",
            color=BEFORE if widened else INK,
            fontweight="bold" if place == 0 else "normal",
            annotation_clip=False,
        )
    axes.annotate(
        "closes", (1.02, -0.75), xycoords=("axes fraction", "data"), color=MUTED, annotation_clip=False
    )
    axes.set_yticks(places, [name for name, _ in rows])
    axes.get_yticklabels()[0].set_fontweight("bold")
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.grid(visible=False, axis="y")
    axes.axhline(0.5, color=LINE, linewidth=0.9)
    values = np.concatenate([before, after, floor])
    values = values[np.isfinite(values)]
    low, high = values.min(initial=1.0) / 1.25, values.max(initial=2.0) * 1.25
    axes.set_xlim(low, high)
    axes.set_xticks([tick for tick in _TICKS if low <= tick <= high])
    axes.xaxis.set_major_formatter(ScalarFormatter())
    axes.xaxis.set_minor_formatter(NullFormatter())


def _material(axes: Axes, values: Sequence[Quantity]) -> None:
    for place, (quantity, colour) in enumerate(zip(values, (BEFORE, AFTER), strict=True)):
        axes.errorbar(
            quantity.value,
            place,
            xerr=_INTERVAL_95 * quantity.std,
            fmt="o",
            markersize=7,
            capsize=4,
            elinewidth=1.8,
            color=colour,
        )
        text = f"{quantity.value:.4g}"
        axes.annotate(
            text, (quantity.value, place), (0, 7), textcoords="offset points", ha="center", fontsize=9
        )
    axes.set_yticks([0, 1], ["before", "after"])
    axes.set_ylim(1.5, -0.9)
    axes.margins(x=0.25)
    axes.grid(visible=False, axis="y")
    axes.ticklabel_format(axis="x", useOffset=False)
    axes.locator_params(axis="x", nbins=5)


def _scaled(quantity: Quantity, factor: float) -> Quantity:
    return Quantity(factor * quantity.value, factor * quantity.std, quantity.unit)
