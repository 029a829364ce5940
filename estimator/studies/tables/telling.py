"""A study's outcome in words: its table, as text and as JSON, and what the paper says of silicones."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimator.studies.paper_tables.paper import SILICONES
from estimator.studies.tables.study import GroupResult, LevelResult, StudyResult, Truth

FloatArray = NDArray[np.float64]

# Where there is no figure: none was found, or the paper's is not known.
NONE = "-"
HEAD = (
    "level",
    "cases",
    "E, kPa",
    "E off",
    "± E",
    "paper: E off",
    "paper: ± E",
    "ν",
    "ν off",
    "± ν",
    "s",
    "paper: s",
    "remark",
)
SILICONE_HEAD = ("Ecoflex 00-30 : thinner", "E by tension, kPa", "E by retraction, kPa", "ν by retraction")


def table_rows(result: GroupResult) -> list[list[str]]:
    """Return the cells of a group's table, a row for each level, below :data:`HEAD`."""
    return [_cells(level, result.group.truth) for level in result.levels]


def silicone_rows() -> list[list[str]]:
    """Return what the paper found on its silicones, below :data:`SILICONE_HEAD`."""
    return [
        [
            silicone.parts,
            f"{silicone.tensile_pa[0] / 1e3:.2f} ± {silicone.tensile_pa[1] / 1e3:.2f}",
            "{:.1f} to {:.1f}".format(*(1e-3 * end for end in silicone.youngs_modulus_pa)),
            "{:.2f} to {:.2f}".format(*silicone.poisson_ratio),
        ]
        for silicone in SILICONES
    ]


def study_text(result: StudyResult) -> str:
    """Return title, notes and tables as text."""
    lines = [result.study.title, *result.study.notes]
    for group in result.groups:
        lines += ["", group.group.title, *aligned([list(HEAD), *table_rows(group)])]
    lines += [f"no estimate: {failure}" for failure in failures(result)]
    if any(group.group.truth is None for group in result.groups):
        lines += ["", "the paper's phantoms", *aligned([list(SILICONE_HEAD), *silicone_rows()])]
    return "\n".join(lines)


def study_json(result: StudyResult) -> dict[str, Any]:
    """Return the outcome in SI units, with every case."""
    return {
        "title": result.study.title,
        "groups": [
            {
                "title": group.group.title,
                "levels": [
                    {
                        "level": level.level.label,
                        "youngs_modulus": level.youngs_modulus.tolist(),
                        "poisson_ratio": level.poisson_ratio.tolist(),
                        "seconds": level.seconds.tolist(),
                        "failures": list(level.failures),
                        "remarks": list(level.remarks),
                        "paper": {
                            "change": level.level.paper.change,
                            "scatter": level.level.paper.scatter,
                            "seconds": level.level.paper.seconds,
                        },
                    }
                    for level in group.levels
                ],
                "truth": None
                if group.group.truth is None
                else {
                    "youngs_modulus": group.group.truth.youngs_modulus,
                    "poisson_ratio": group.group.truth.poisson_ratio,
                },
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


def _cells(level: LevelResult, truth: Truth | None) -> list[str]:
    modulus, ratio, paper = level.youngs_modulus, level.poisson_ratio, level.level.paper
    mean_modulus = float(modulus.mean()) if len(modulus) else math.nan
    mean_ratio = float(ratio.mean()) if len(ratio) else math.nan
    off = math.nan if truth is None else mean_modulus / truth.youngs_modulus - 1
    ratio_off = math.nan if truth is None else mean_ratio - truth.poisson_ratio
    # Against the truth where there is one, as the paper has it.
    reference = mean_modulus if truth is None else truth.youngs_modulus
    return [
        level.level.label,
        f"{len(modulus)} of {len(level.level.cases)}",
        _number(mean_modulus / 1e3, ".2f"),
        _percent(off),
        _percent(_spread(modulus) / reference).lstrip("+"),
        _percent(paper.change),
        _percent(paper.scatter).lstrip("+"),
        _number(mean_ratio, ".4f"),
        _number(ratio_off, "+.4f"),
        _number(_spread(ratio), ".4f"),
        _number(float(np.median(level.seconds)) if len(level.seconds) else None, ".2f"),
        _number(paper.seconds, ".0f"),
        "; ".join(level.remarks),
    ]


def _spread(values: FloatArray) -> float:
    """Return the standard deviation of a sample; NaN for less than two values."""
    return float(values.std(ddof=1)) if len(values) > 1 else math.nan


def _percent(share: float | None) -> str:
    return NONE if share is None or math.isnan(share) else f"{100 * share:+.2f} %"


def _number(value: float | None, form: str) -> str:
    return NONE if value is None or math.isnan(value) else f"{value:{form}}"
