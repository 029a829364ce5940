"""A uniaxial fit as JSON, as a table for the terminal, and as a page that needs no network."""

import math
from functools import partial
from itertools import cycle, product
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from estimator.report import page
from estimator.report.drawing.marks import plot_measured
from estimator.report.theme import ANCHOR, COLOURS, GRASP, INK, MUTED, PLOT_STYLE, PREDICTED, TRUTH
from estimator.uniaxial.fit import RankedLaw, UniaxialFit
from estimator.uniaxial.law_fit import Estimate, FloatArray
from estimator.uniaxial.records import UniaxialRecord

_PLOT_SIZE_IN = (11.4, 4.8)
_PNG_DPI = 150
# Line styles and colours of the laws, best first.
_LINES = tuple(product(("-", (0, (4, 2))), (PREDICTED, TRUTH, ANCHOR, GRASP, INK)))

_COLUMNS = (
    "law",
    "E, kPa",
    "rms fitted, kPa",
    "rms held out, kPa",
    "closure",
    "stable",
    "other parameters",
)


def as_json(fit: UniaxialFit) -> dict[str, Any]:
    """Return plain types for ``json.dumps``; SI units, an infinite error is null."""
    record = fit.record
    return {
        "record": {
            "name": record.name,
            "path": None if record.path is None else str(record.path),
            "mode": record.mode,
            "rows": len(record.strain),
            "shape_factor": record.shape_factor,
        },
        "mode": record.mode,
        "mode_from": record.mode_from,
        "found": list(record.found),
        "assumed": list(record.assumed),
        "left_out": list(record.left_out),
        "strain": {"from": fit.strain_from, "fit": fit.strain_fit, "test": fit.strain_test},
        "rows": {"fit": fit.rows_fit, "test": fit.rows_test},
        "best": fit.best.fit.law.name,
        "ranking": [ranked.fit.law.name for ranked in fit.ranking],
        "laws": {ranked.fit.law.name: _law_as_json(fit, ranked) for ranked in fit.ranking},
        "caveats": list(fit.caveats),
    }


def as_text(fit: UniaxialFit) -> str:
    """Return a table of the laws, best first, with the caveats and how the record was read below it."""
    table = [_COLUMNS, *(_cells(fit, ranked) for ranked in fit.ranking)]
    widths = [max(len(row[i]) for row in table) for i in range(len(_COLUMNS))]
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in table
    ]
    caveats = ["", *(f"- {caveat}" for caveat in fit.caveats)] if fit.caveats else []
    told = [f"{word}: {sentence}" for word, sentence in _how_read(fit.record)]
    return "\n".join([_summary(fit), "", *lines, *caveats, *(["", *told] if told else [])])


def write_report(fit: UniaxialFit, folder: Path | str) -> Path:
    """Write ``uniaxial.html``, a single file, and its plot ``uniaxial.png``; return the page's path."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    draw = partial(_draw, fit=fit)
    blocks = [
        page.headline(_summary(fit)),
        page.figure(
            draw,
            _PLOT_SIZE_IN,
            "Stress over strain, measured and of every law, and what each law leaves of it. The laws were fitted "
            "where it is shaded, and the line of a law that does not admit every strain ends there. Of lines that "
            "coincide the better law's is on top.",
        ),
        page.table("Laws", _COLUMNS, [_cells(fit, ranked) for ranked in fit.ranking]),
        page.note(
            "± is one standard error from a jackknife over blocks of strain, rms the root mean square error. Closure "
            "is the share of the Neo-Hookean law's held-out error that the law removes."
        ),
        page.warnings(fit.caveats),
    ]
    if how_read := _how_read(fit.record):
        blocks.append(page.table("How the record was read", ("", ""), how_read))
    if fit.record.facts:
        blocks.append(page.facts("Stated by the file", fit.record.facts))
    report = target / "uniaxial.html"
    report.write_text(page.page(fit.record.name, blocks), encoding="utf-8")
    with matplotlib.rc_context(PLOT_STYLE):
        sheet = Figure(figsize=_PLOT_SIZE_IN)
        draw(sheet)
        sheet.savefig(target / "uniaxial.png", dpi=_PNG_DPI, facecolor=COLOURS["paper"].light)
    return report


def _draw(sheet: Figure, fit: UniaxialFit) -> None:
    """Draw the curve with every law, and what each law leaves of it."""
    curve, rest = sheet.subplots(1, 2)
    sheet.subplots_adjust(left=0.06, right=0.99, bottom=0.12, top=0.9, wspace=0.17)
    shown = np.abs(fit.record.strain) <= fit.strain_test
    strain, stress = fit.record.strain[shown], fit.record.stress[shown]
    percent, measured_kpa = 100 * np.abs(strain), np.abs(stress) / 1e3
    plot_measured(curve, percent, measured_kpa, size=3.2)
    for rank, (ranked, (style, colour)) in enumerate(zip(fit.ranking, cycle(_LINES), strict=False)):
        law_kpa = np.abs(_plotted_stress(fit, ranked, strain)) / 1e3
        label = ranked.fit.law.name.replace("_", " ")
        for axes, ordinate in ((curve, law_kpa), (rest, law_kpa - measured_kpa)):
            axes.plot(
                percent,
                ordinate,
                linestyle=style,
                color=colour,
                label=label,
                zorder=3 - rank / len(fit.ranking),
            )
    highest = float(measured_kpa.max())
    curve.set_ylim(0, 1.15 * highest)
    curve.set_ylabel("nominal stress, kPa")
    rest.set_ylim(-0.3 * highest, 0.3 * highest)
    rest.set_ylabel("law less measured, kPa")
    for axes in (curve, rest):
        axes.axvspan(
            100 * fit.strain_from, 100 * fit.strain_fit, color=MUTED, alpha=0.13, linewidth=0, zorder=0
        )
        axes.set_xlabel(f"{fit.record.mode}, %")
    handles, labels = curve.get_legend_handles_labels()
    sheet.legend(handles, labels, loc="upper right", ncols=len(handles), borderaxespad=0.2)


def _plotted_stress(fit: UniaxialFit, ranked: RankedLaw, strain: FloatArray) -> FloatArray:
    """Return the law's stress; NaN beyond the fitted range where the law does not reach the tested one."""
    within = np.isfinite(ranked.rms_test) | (np.abs(strain) <= fit.strain_fit)
    found = np.full(len(strain), np.nan)
    found[within] = ranked.fit.stress(strain[within])
    return found


def _summary(fit: UniaxialFit) -> str:
    best, modulus = fit.best.fit, fit.best.fit.youngs_modulus
    if not math.isfinite(fit.best.rms_test):
        choice = f"No stable law admits all of those; {best.law.name} has"
    elif fit.best.stable:
        choice = f"Of the stable laws {best.law.name} predicts those best, with"
    else:
        choice = f"No law is stable; {best.law.name} predicts those best, with"
    value, std = modulus.value / 1e3, modulus.std / 1e3
    return (
        f"{fit.record.name}, {fit.record.mode}: fitted to strains of {fit.strain_from:.3g} to "
        f"{fit.strain_fit:.3g} ({fit.rows_fit} rows), held against strains up to {fit.strain_test:.3g} "
        f"({fit.rows_test} rows). {choice} E = {value:.3g} ± {std:.2g} kPa."
    )


def _how_read(record: UniaxialRecord) -> list[tuple[str, str]]:
    """Return what was found, supposed and left out, each with the word for it."""
    mode = [("mode", f"{record.mode}, from {record.mode_from}")] if record.mode_from else []
    return [
        *mode,
        *(("found", sentence) for sentence in record.found),
        *(("assumed", sentence) for sentence in record.assumed),
        *(("left out", sentence) for sentence in record.left_out),
    ]


def _law_as_json(fit: UniaxialFit, ranked: RankedLaw) -> dict[str, Any]:
    held_out = ranked.rms_test if math.isfinite(ranked.rms_test) else None
    return {
        "youngs_modulus": _estimate_as_json(ranked.fit.youngs_modulus),
        "shape": {parameter.name: _estimate_as_json(parameter) for parameter in ranked.fit.shape},
        "slack": None if ranked.fit.slack is None else _estimate_as_json(ranked.fit.slack),
        "rms_fit": ranked.rms_fit,
        "rms_test": held_out,
        "closure_held_out": None if held_out is None else fit.closure(ranked),
        "stable": ranked.stable,
    }


def _estimate_as_json(estimate: Estimate) -> dict[str, Any]:
    return {
        "value": estimate.value,
        "std": estimate.std,
        "interval95": list(estimate.interval95),
        "at_bound": estimate.at_bound,
    }


def _cells(fit: UniaxialFit, ranked: RankedLaw) -> tuple[str, ...]:
    modulus, removed = ranked.fit.youngs_modulus, fit.closure(ranked)
    return (
        ranked.fit.law.name,
        f"{modulus.value / 1e3:.4g} ± {modulus.std / 1e3:.2g}",
        f"{ranked.rms_fit / 1e3:.3g}",
        f"{ranked.rms_test / 1e3:.3g}" if math.isfinite(ranked.rms_test) else "∞",
        "" if removed is None or not math.isfinite(removed) else f"{round(100 * removed)} %",
        "yes" if ranked.stable else "no",
        ", ".join(_parameter(parameter) for parameter in ranked.fit.parameters[1:]),
    )


def _parameter(estimate: Estimate) -> str:
    spread = "at its bound" if estimate.at_bound else f"± {estimate.std:.2g}"
    return f"{estimate.name} {estimate.value:.3g} {spread}"
