"""How the fit came to its values."""

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from estimator.fit.result import Estimate, ParameterEstimate
from estimator.report.estimation.facts import stage_starts
from estimator.report.estimation.findings import Truth
from estimator.report.theme import MEASURED, PREDICTED, TRUTH


def draw_convergence(sheet: Figure, estimate: Estimate, truth: Truth | None) -> None:
    """Draw E, ν and the misfit against the iteration; bands are the final 95 % intervals."""
    modulus, ratio, misfit = sheet.subplots(1, 3)
    sheet.subplots_adjust(left=0.08, right=0.99, bottom=0.17, top=0.88, wspace=0.36)
    iterates = estimate.iterates
    _parameter(
        modulus,
        [i.values["youngs_modulus"] / 1e3 for i in iterates],
        _interval(estimate.youngs_modulus, 1e-3),
        None if truth is None else truth.youngs_modulus / 1e3,
    )
    modulus.set_ylabel("Young's modulus E, kPa")
    _parameter(
        ratio,
        [i.values["poisson_ratio"] for i in iterates],
        _interval(estimate.poisson_ratio, 1.0),
        None if truth is None else truth.poisson_ratio,
    )
    ratio.set_ylabel("Poisson's ratio ν")
    for start, stop in pairwise(stage_starts(iterates)):
        steps = np.arange(start, stop)
        misfit.semilogy(steps, [iterates[n].chi2 for n in steps], "o-", color=PREDICTED, markersize=5)
    misfit.set_ylabel("misfit χ²")
    for axes in (modulus, ratio, misfit):
        axes.set_xlabel("iteration")
        axes.set_xticks(np.arange(0, len(iterates), max(1, len(iterates) // 8)))
    sheet.legend(*modulus.get_legend_handles_labels(), loc="upper right", ncols=3, borderaxespad=0.2)


def _parameter(axes: Axes, values: list[float], interval: tuple[float, float], truth: float | None) -> None:
    axes.axhspan(*interval, color=MEASURED, alpha=0.2, linewidth=0, label="95 % interval")
    if truth is not None:
        axes.axhline(truth, color=TRUTH, linestyle=(0, (5, 3)), label="truth")
    axes.plot(values, "o-", color=PREDICTED, markersize=5, label="iterate")
    axes.ticklabel_format(axis="y", useOffset=False)


def _interval(estimate: ParameterEstimate, factor: float) -> tuple[float, float]:
    low, high = estimate.interval95
    return factor * low, factor * high
