"""A uniaxial fit as JSON, as a table for the terminal, and as a page that needs no network."""

import base64
import html
import io
import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from estimator.uniaxial.fit import RankedLaw, UniaxialFit
from estimator.uniaxial.law_fit import Estimate, FloatArray

_COLUMNS = (
    "law",
    "E, kPa",
    "error fitted, Pa",
    "error held out, Pa",
    "closure",
    "stable",
    "other parameters",
)

_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title><style>
body {{ font: 15px/1.5 system-ui, sans-serif; max-width: 70em; margin: 2em auto; padding: 0 1em }}
table {{ border-collapse: collapse }}
th, td {{ padding: .25em .8em; text-align: left; border-bottom: 1px solid #ccc }}
img {{ max-width: 100% }} .note {{ color: #555 }}
</style></head><body>
<h1>{title}</h1>
<p>{summary}</p>
<img alt="stress over strain, data and fitted laws" src="data:image/png;base64,{image}">
<table><tr>{head}</tr>
{rows}
</table>
<p class="note">± is one standard error from a jackknife over blocks of strain. Closure is the share of the
Neo-Hookean law's held-out error that the law removes.</p>
<ul>
{caveats}
</ul>
<h2>Stated by the file</h2>
<ul>
{facts}
</ul>
</body></html>
"""


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
        "strain": {"from": fit.strain_from, "fit": fit.strain_fit, "test": fit.strain_test},
        "rows": {"fit": fit.rows_fit, "test": fit.rows_test},
        "best": fit.best.fit.law.name,
        "ranking": [ranked.fit.law.name for ranked in fit.ranking],
        "laws": {ranked.fit.law.name: _law_as_json(fit, ranked) for ranked in fit.ranking},
        "caveats": list(fit.caveats),
    }


def as_text(fit: UniaxialFit) -> str:
    """Return a table of the laws, best first, with the caveats below it."""
    table = [_COLUMNS, *(_cells(fit, ranked) for ranked in fit.ranking)]
    widths = [max(len(row[i]) for row in table) for i in range(len(_COLUMNS))]
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in table
    ]
    return "\n".join([_summary(fit), "", *lines, "", *(f"- {caveat}" for caveat in fit.caveats)])


def write_report(fit: UniaxialFit, folder: Path | str) -> Path:
    """Write ``uniaxial.html``, a single file, and its plot ``uniaxial.png``; return the page's path."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    image = plot(fit)
    (target / "uniaxial.png").write_bytes(image)
    page = target / "uniaxial.html"
    page.write_text(
        _PAGE.format(
            title=html.escape(fit.record.name),
            summary=html.escape(_summary(fit)),
            image=base64.b64encode(image).decode("ascii"),
            head="".join(f"<th>{column}</th>" for column in _COLUMNS),
            rows="\n".join(_html_row(_cells(fit, ranked)) for ranked in fit.ranking),
            caveats="\n".join(f"<li>{html.escape(caveat)}</li>" for caveat in fit.caveats),
            facts="\n".join(
                f"<li>{html.escape(key)}: {html.escape(value)}</li>"
                for key, value in fit.record.facts.items()
            ),
        ),
        encoding="utf-8",
    )
    return page


def plot(fit: UniaxialFit) -> bytes:
    """Return a PNG: the curve with every law, and what each law leaves of it."""
    figure = Figure(figsize=(12, 4.8), layout="constrained")
    curve, rest = figure.subplots(1, 2)
    magnitude = np.abs(fit.record.strain)
    shown = magnitude <= fit.strain_test
    strain, stress = fit.record.strain[shown], fit.record.stress[shown]
    curve.plot(100 * np.abs(strain), np.abs(stress) / 1e3, ".", color="0.6", label="measured")
    for ranked in fit.ranking:
        found = _plotted_stress(fit, ranked, strain)
        label = ranked.fit.law.name.replace("_", " ")
        curve.plot(100 * np.abs(strain), np.abs(found) / 1e3, linewidth=1, label=label)
        rest.plot(100 * np.abs(strain), (np.abs(found) - np.abs(stress)) / 1e3, linewidth=1, label=label)
    curve.set_ylim(0, 1.15 * float(np.abs(stress).max()) / 1e3)
    curve.set_ylabel("nominal stress, kPa")
    reach = 0.3 * float(np.abs(stress).max()) / 1e3
    rest.set_ylim(-reach, reach)
    rest.set_ylabel("law less measured, kPa")
    for axes in (curve, rest):
        axes.axvspan(100 * fit.strain_from, 100 * fit.strain_fit, color="0.93", zorder=0)
        axes.set_xlabel(f"{fit.record.mode}, % (fitted where shaded)")
    curve.legend(fontsize=8)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=110)
    return buffer.getvalue()


def _plotted_stress(fit: UniaxialFit, ranked: RankedLaw, strain: FloatArray) -> FloatArray:
    """Return the law's stress; NaN beyond the fitted range where the law does not reach the tested one."""
    within = np.isfinite(ranked.rms_test) | (np.abs(strain) <= fit.strain_fit)
    found = np.full(len(strain), np.nan)
    found[within] = ranked.fit.stress(strain[within])
    return found


def _summary(fit: UniaxialFit) -> str:
    best, modulus = fit.best.fit, fit.best.fit.youngs_modulus
    choice = "Of the stable laws" if fit.best.stable else "No law is stable;"
    return (
        f"{fit.record.name}, {fit.record.mode}: fitted to strains of {fit.strain_from:.3g} to "
        f"{fit.strain_fit:.3g} ({fit.rows_fit} rows), held against strains up to {fit.strain_test:.3g} "
        f"({fit.rows_test} rows). {choice} {best.law.name} predicts those best, with "
        f"E = {modulus.value / 1e3:.3g} ± {modulus.std / 1e3:.2g} kPa."
    )


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
        f"{ranked.rms_fit:.4g}",
        f"{ranked.rms_test:.4g}",
        "" if removed is None or not math.isfinite(removed) else f"{round(100 * removed)} %",
        "yes" if ranked.stable else "no",
        ", ".join(_parameter(parameter) for parameter in ranked.fit.parameters[1:]),
    )


def _parameter(estimate: Estimate) -> str:
    spread = "at its bound" if estimate.at_bound else f"± {estimate.std:.2g}"
    return f"{estimate.name} {estimate.value:.3g} {spread}"


def _html_row(cells: tuple[str, ...]) -> str:
    return "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in cells) + "</tr>"
