"""A study's outcome in words: its tables, the paper's figures beside ours, as text and as JSON."""

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimator.studies.tables.figure import Figure
from estimator.studies.tables.study import GroupResult, LevelResult, StudyResult, Truth

FloatArray = NDArray[np.float64]

# Where there is no figure: none was found, or the paper gives none.
NONE = "-"
HEAD = (
    "level",
    "cases",
    "E, kPa",
    "paper",
    "E off",
    "ν",
    "paper",
    "ν off",
    "RMSE fiducials, mm",
    "paper",
    "RMSE force, mN",
    "paper",
    "iterations (calls)",
    "paper",
    "time, s",
    "paper",
    "remark",
)


def table_rows(result: GroupResult) -> list[list[str]]:
    """Return the cells of a group's table, a row for each level, below :data:`HEAD`."""
    return [_cells(level, result.group.truth) for level in result.levels]


def study_text(result: StudyResult) -> str:
    """Return title, notes and tables as text."""
    lines = [result.study.title, *result.study.notes]
    for group in result.groups:
        lines += ["", group.group.title, *aligned([list(HEAD), *table_rows(group)])]
    lines += [f"no estimate: {failure}" for failure in failures(result)]
    return "\n".join(lines)


def study_json(result: StudyResult) -> dict[str, Any]:
    """Return the outcome in SI units, with every case."""
    return {
        "title": result.study.title,
        "groups": [
            {
                "title": group.group.title,
                "levels": [_level_json(level) for level in group.levels],
                "truth": None if group.group.truth is None else asdict(group.group.truth),
            }
            for group in result.groups
        ],
    }


def failures(result: StudyResult) -> list[str]:
    """Return why cases gave no estimate, with their level."""
    return [
        f"{level.level.label}: {failure}"
        for group in result.groups
        for level in group.levels
        for failure in level.failures
    ]


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return rows of cells as lines in which they stand below each other; columns without any figure go."""
    kept = [n for n in range(len(rows[0])) if any(row[n] not in ("", NONE) for row in rows[1:])]
    width = {n: max(len(row[n]) for row in rows) for n in kept}
    return ["  " + "  ".join(row[n].ljust(width[n]) for n in kept).rstrip() for row in rows]


def spread_of(values: FloatArray) -> float:
    """Return the standard deviation of a sample; NaN for less than two values."""
    known = values[np.isfinite(values)]
    return float(known.std(ddof=1)) if len(known) > 1 else math.nan


def _level_json(level: LevelResult) -> dict[str, Any]:
    paper = level.level.paper
    return {
        "level": level.level.label,
        **{
            name: [None if math.isnan(value) else value for value in values.tolist()]
            for name, values in level.columns.items()
        },
        "failures": level.failures,
        "remarks": level.remarks,
        "paper": None if paper is None else asdict(paper),
    }


def _cells(level: LevelResult, truth: Truth | None) -> list[str]:
    paper = level.level.paper or Figure(math.nan, math.nan)
    modulus, ratio = (_mean(level.columns[name]) for name in ("youngs_modulus", "poisson_ratio"))
    off = math.nan if truth is None else modulus / truth.youngs_modulus - 1
    ratio_off = math.nan if truth is None else ratio - truth.poisson_ratio
    columns, spread = level.columns, paper.scatter
    return [
        level.level.label,
        f"{len(level.youngs_modulus)} of {len(level.level.cases)}",
        _ours(columns["youngs_modulus"], 1e-3, ".2f"),
        _theirs(paper.youngs_modulus_pa, 1e-3, ".2f", spread.get("youngs_modulus")),
        NONE if math.isnan(off) else f"{100 * off:+.1f} %",
        _ours(columns["poisson_ratio"], 1.0, ".4f"),
        _theirs(paper.poisson_ratio, 1.0, ".4f", spread.get("poisson_ratio")),
        NONE if math.isnan(ratio_off) else f"{ratio_off:+.4f}",
        _ours(columns["rmse_fiducials"], 1e3, ".3g"),
        _theirs(paper.rmse_fiducials_m, 1e3, ".3g", spread.get("rmse_fiducials")),
        _ours(columns["rmse_force"], 1e3, ".3g"),
        _theirs(paper.rmse_force_n, 1e3, ".3g", spread.get("rmse_force")),
        _counts(_mean(columns["iterations"]), _mean(columns["calls"])),
        _counts(paper.iterations, paper.calls),
        _ours(columns["seconds"], 1.0, ".3g"),
        _theirs(paper.seconds, 1.0, ".0f", spread.get("seconds")),
        "; ".join(level.remarks),
    ]


def _mean(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else math.nan


def _ours(values: FloatArray, unit: float, form: str) -> str:
    mean = _mean(values)
    if math.isnan(mean):
        return NONE
    spread = spread_of(values)
    return f"{unit * mean:{form}}" + ("" if math.isnan(spread) else _percent(spread / mean))


def _theirs(value: float | None, unit: float, form: str, spread: float | None) -> str:
    if value is None or math.isnan(value):
        return NONE
    return f"{unit * value:{form}}" + ("" if spread is None else _percent(spread))


def _percent(share: float) -> str:
    return f" ± {100 * share:.0f} %"


def _counts(iterations: float | None, calls: float | None) -> str:
    if iterations is None or calls is None or math.isnan(iterations) or math.isnan(calls):
        return NONE
    return f"{iterations:.0f} ({calls:.0f})"
