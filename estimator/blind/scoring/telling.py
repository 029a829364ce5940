"""A score in words, as a page, and as a picture."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure as Sheet

from estimator.blind.scoring.reliability import Claim
from estimator.blind.scoring.score import Confusion, Score
from estimator.blind.scoring.scored import Metric
from estimator.errors import InputError
from estimator.report import page
from estimator.report.theme import COLOURS, MUTED, PLOT_STYLE, PREDICTED, TRUTH

_HEAD = ("", "value", "95 % interval", "cases", "at best")
_FAMILIES = {
    "exact": "forms that the catalogue has",
    "near": "forms that the catalogue has nearly",
    "far": "forms that the catalogue has not",
}
_CLAIMS_HEAD = ("an answer that claims", "on average", "is right", "95 % interval", "cases")
_CLAIMS_IN = (9.0, 3.8)
_CELL_IN = 0.3
_LABELS_IN = 2.1
_SMALLEST_IN = 5.0
_FAINTEST = 0.25
_DPI = 130


def score_text(score: Score) -> str:
    """Return the score as lines for the terminal."""
    rows = [_HEAD, *map(_cells, score.metrics)]
    for level, found in score.by_level.items():
        rows += [(f"level {level}", "", "", "", ""), *map(_cells, found)]
    for family, found in score.by_family.items():
        rows += [(_FAMILIES[family], "", "", "", ""), *map(_cells, found)]
    claims = [_CLAIMS_HEAD, *map(_claim_cells, score.by_claim)] if score.by_claim else []
    return "\n".join([_counts(score), *_aligned(rows), *_aligned(claims)])


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return lines of cells below each other: the first ones to the left, the others to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for name, *cells in rows:
        padded = "  ".join(cell.rjust(width) for cell, width in zip(cells, widths[1:], strict=True))
        lines.append(f"{name.ljust(widths[0])}  {padded}".rstrip())
    return lines


def check_writable(path: Path) -> None:
    """Check the name of a file before the keys are opened for it.

    Raises
    ------
    InputError
        It ends neither in ``.html`` nor in ``.png``.
    """
    if path.suffix not in (".html", ".png"):
        raise InputError(f"{path}: a score is written as .html or .png; choose one of them")


def write_score(score: Score, path: Path, title: str) -> None:
    """Write the score as a page (``.html``), or its confusion matrices as a picture (``.png``)."""
    check_writable(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".html":
        path.write_text(_page(score, title), encoding="utf-8")
        return
    sheets = (score.groups, score.labels)
    widths, height = [_size_in(one) for one in sheets], max(map(_size_in, sheets))
    with rc_context({**PLOT_STYLE, "figure.facecolor": COLOURS["paper"].light}):
        sheet = Sheet(figsize=(sum(widths), height))
        parts = sheet.subfigures(1, 2, squeeze=False, width_ratios=widths)
        for part, confusion in zip(parts[0], sheets, strict=True):
            part.set_facecolor("none")
            _draw_confusion(part.add_axes(_box(confusion, (_size_in(confusion), height))), confusion)
        sheet.savefig(path, dpi=_DPI)


def _page(score: Score, title: str) -> str:
    blocks = [page.headline(_counts(score)), page.heading("Figures")]
    blocks += [
        page.table("", _HEAD, map(_cells, score.metrics)),
        page.heading("Single causes by how far they stand out"),
    ]
    blocks += [page.table(level, _HEAD, map(_cells, found)) for level, found in score.by_level.items()]
    if score.by_family:
        blocks.append(page.heading("By how far the catalogue knows the form"))
    blocks += [
        page.table(_FAMILIES[family], _HEAD, map(_cells, found)) for family, found in score.by_family.items()
    ]
    if not score.by_claim:  # of several causes alone there is no single answer
        return page.page(title, blocks)
    blocks += _of_claims(score.by_claim)
    for name, confusion in (("group", score.groups), ("label", score.labels)):
        size_in = (max(map(_size_in, (score.groups, score.labels))), _size_in(confusion))
        drawn = page.figure(
            partial(_draw_sheet, confusion=confusion, size_in=size_in),
            size_in,
            "Rows: what is true. Columns: the leading answer. Green is right. Cases with several causes are left out.",
        )
        blocks += [page.heading(f"Confusion by {name}"), drawn]
    return page.page(title, blocks)


def _of_claims(claims: Sequence[Claim]) -> list[page.Html]:
    """Return the part of the page that tells whether answers are right as often as they claim."""
    drawn = page.figure(
        partial(_draw_claims, claims=claims),
        _CLAIMS_IN,
        "The probability of the leading answers, and how many of them are right, with 95 % intervals. On the line "
        "an answer is right as often as it claims. Cases with several causes are left out.",
    )
    return [
        page.heading("Right as often as claimed"),
        drawn,
        page.table("", _CLAIMS_HEAD, map(_claim_cells, claims)),
    ]


def _counts(score: Score) -> str:
    kinds = ", ".join(f"{count} {kind}" for kind, count in score.cases.items())
    left = f"; {len(score.unanswered)} with a key have no answer and are left out" if score.unanswered else ""
    times = "once" if score.openings == 1 else f"{score.openings} times"
    given = "".join(f" {name}: {standing}." for name, standing in score.standings.items())
    return f"{sum(score.cases.values())} cases ({kinds}){left}. The keys have been opened {times}.{given}"


def _cells(metric: Metric) -> tuple[str, ...]:
    figure = metric.figure
    if not figure.count:
        return metric.name, "–", "", "0", ""
    interval = f"{_value(figure.low, metric.unit)} to {_value(figure.high, metric.unit)}"
    ceiling = "" if metric.ceiling is None else _value(metric.ceiling, metric.unit)
    return metric.name, _value(figure.value, metric.unit), interval, str(figure.count), ceiling


def _claim_cells(claim: Claim) -> tuple[str, ...]:
    between = f"{100 * claim.low:.0f} to {100 * claim.high:.0f} %"
    right = claim.right
    interval = f"{_value(right.low, '%')} to {_value(right.high, '%')}"
    return between, _value(claim.claimed, "%"), _value(right.value, "%"), interval, str(right.count)


def _value(value: float, unit: str) -> str:
    if unit == "%":
        return f"{100 * value:.1f} %"
    return f"{value:.1f} {unit}" if unit else f"{value:.3f}"


def _size_in(confusion: Confusion) -> float:
    return max(_SMALLEST_IN, _LABELS_IN + 0.3 + _CELL_IN * len(confusion.names))


def _box(confusion: Confusion, sheet_in: tuple[float, float]) -> tuple[float, float, float, float]:
    """Return where the axes are in a sheet: in its upper left corner, right of and below the labels."""
    width, height = sheet_in
    side = _size_in(confusion) - _LABELS_IN - 0.3
    return _LABELS_IN / width, 1 - (_LABELS_IN + side) / height, side / width, side / height


def _draw_sheet(sheet: Sheet, confusion: Confusion, size_in: tuple[float, float]) -> None:
    _draw_confusion(sheet.add_axes(_box(confusion, size_in)), confusion)


def _draw_claims(sheet: Sheet, claims: Sequence[Claim]) -> None:
    axes = sheet.add_axes((0.08, 0.14, 0.35, 0.83))
    axes.plot([0, 100], [0, 100], color=MUTED, lw=1)
    claimed = [100 * claim.claimed for claim in claims]
    low = [100 * claim.right.low for claim in claims]
    high = [100 * claim.right.high for claim in claims]
    axes.vlines(claimed, low, high, color=TRUTH)
    axes.scatter(claimed, [100 * claim.right.value for claim in claims], color=TRUTH)
    axes.set_xlim(0, 102)
    axes.set_ylim(0, 102)
    axes.set_xlabel("claimed, %")
    axes.set_ylabel("right, %")


def _draw_confusion(axes: Axes, confusion: Confusion) -> None:
    """Draw a square for each pair that occurs, with its count; the share of its row makes the colour."""
    names = [name.replace("_", " ") for name in confusion.names]
    if not names:
        axes.set_axis_off()
        return
    for row, of_truth in enumerate(confusion.counts):
        for column, count in enumerate(of_truth):
            if count:
                opacity = _FAINTEST + (1 - _FAINTEST) * 0.8 * count / of_truth.sum()
                colour = (*to_rgb(TRUTH if row == column else PREDICTED), opacity)
                axes.fill(
                    [column, column + 1, column + 1, column], [row, row, row + 1, row + 1], color=colour, lw=0
                )
                axes.annotate(str(count), (column + 0.5, row + 0.5), ha="center", va="center", fontsize=8.5)
    places = [n + 0.5 for n in range(len(names))]
    axes.set_xticks(places, names, rotation=90)
    axes.set_yticks(places, names)
    axes.set_xticks(range(len(names) + 1), minor=True)
    axes.set_yticks(range(len(names) + 1), minor=True)
    axes.xaxis.tick_top()
    axes.set_xlabel("answer")
    axes.set_ylabel("truth")
    axes.set_xlim(0, len(names))
    axes.set_ylim(len(names), 0)
    axes.grid(visible=False)
    axes.grid(visible=True, which="minor")
    axes.tick_params(which="both", length=0)
