"""Recorded retractions in the layout of the paper's Tables VI and VII, beside the bench test and the paper's own."""

from collections.abc import Mapping, Sequence

from estimator.studies.paper_tables.figures import BENCH, HOLLENSTEIN_PA, TABLE_VI, TABLE_VII
from estimator.studies.phantom_tables.bench import BenchTest
from estimator.studies.phantom_tables.recorded import RecordedRetraction
from estimator.studies.running.case import Row
from estimator.studies.tables.figure import Figure
from estimator.studies.tables.telling import NONE, aligned

Rows = list[list[str]]

# What became of each retraction, the failed ones left out.
Found = Sequence[tuple[RecordedRetraction, Row]]

PAPER_HEAD = ("", *(f"{motion.replace('_', ' ')} {silicone}" for motion, silicone in TABLE_VI))


def anchorings(found: Found) -> list[str]:
    """Return the anchorings that were recorded, each once."""
    return list(dict.fromkeys(case.anchoring for case, _ in found))


def table_of(found: Found, anchoring: str, bench: Mapping[str, BenchTest]) -> tuple[list[str], Rows]:
    """Return head and rows of an anchoring's table: a column for each motion and phantom, repeats side by side."""
    chosen = [(case, row) for case, row in found if case.anchoring == anchoring]
    motions = list(dict.fromkeys(case.motion for case, _ in chosen))
    chosen.sort(key=lambda one: (motions.index(one[0].motion), one[0].experiment.phantom_id))
    head = ["", *(f"{case.motion} {case.experiment.phantom_id}" for case, _ in chosen)]
    rows = [
        ["E, Pa", *(f"{float(row['youngs_modulus']):.0f}" for _, row in chosen)],
        ["E, 95 %", *(_ends(row, "youngs_modulus", ".0f") for _, row in chosen)],
        ["ν", *(f"{float(row['poisson_ratio']):.4f}" for _, row in chosen)],
        ["ν, 95 %", *(_ends(row, "poisson_ratio", ".4f") for _, row in chosen)],
        ["time, s", *(f"{float(row['seconds']):.1f}" for _, row in chosen)],
        [
            "iterations (calls)",
            *(f"{float(r['iterations']):.0f} ({float(r['calls']):.0f})" for _, r in chosen),
        ],
        ["RMSE fiducials, mm", *(f"{1e3 * float(row['rmse_fiducials']):.3f}" for _, row in chosen)],
        ["RMSE force, mN", *(f"{1e3 * float(row['rmse_force']):.1f}" for _, row in chosen)],
        ["bench test, Pa", *(_bench(bench.get(case.experiment.phantom_id)) for case, _ in chosen)],
        ["E off the bench's", *(_off(row, bench.get(case.experiment.phantom_id)) for case, row in chosen)],
    ]
    return head, rows


def paper_rows(table: Mapping[tuple[str, str], Figure]) -> Rows:
    """Return a table of the paper, below :data:`PAPER_HEAD`."""
    figures = list(table.values())
    bench = [BENCH[silicone] for _, silicone in table]
    return [
        ["E, Pa", *(f"{one.youngs_modulus_pa:.0f}" for one in figures)],
        ["ν", *(f"{one.poisson_ratio:g}" for one in figures)],
        ["time, s", *(f"{one.seconds:.0f}" for one in figures)],
        ["iterations (calls)", *(f"{one.iterations} ({one.calls})" for one in figures)],
        ["bench test, Pa", *(f"{mean:.0f} ± {deviation:.0f}" for mean, deviation in bench)],
        [
            "E off the bench's",
            *(
                f"{100 * (one.youngs_modulus_pa / mean - 1):+.0f} %"
                for one, (mean, _) in zip(figures, bench, strict=True)
            ),
        ],
    ]


def layout_text(found: Found, bench: Mapping[str, BenchTest]) -> str:
    """Return the tables as text, the paper's own below."""
    lines: list[str] = []
    for anchoring in anchorings(found):
        head, rows = table_of(found, anchoring, bench)
        lines += [f"{anchoring} anchored", *aligned([head, *rows]), ""]
    lines += [
        "the paper's Table VI, one side anchored",
        *aligned([list(PAPER_HEAD), *paper_rows(TABLE_VI)]),
        "",
    ]
    lines += [
        "the paper's Table VII, two sides anchored",
        *aligned([list(PAPER_HEAD), *paper_rows(TABLE_VII)]),
    ]
    lines.append(f"  Hollenstein gives {HOLLENSTEIN_PA / 1e3:g} kPa for 1:1:0")
    return "\n".join(lines)


def _ends(row: Row, name: str, form: str) -> str:
    if f"{name}_low" not in row:
        return NONE
    return f"{float(row[f'{name}_low']):{form}}..{float(row[f'{name}_high']):{form}}"


def _bench(test: BenchTest | None) -> str:
    return NONE if test is None else f"{test.youngs_modulus_pa:.0f} ± {test.std_pa:.0f}"


def _off(row: Row, test: BenchTest | None) -> str:
    return (
        NONE
        if test is None
        else f"{100 * (float(row['youngs_modulus']) / test.youngs_modulus_pa - 1):+.1f} %"
    )
