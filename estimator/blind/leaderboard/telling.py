"""A leaderboard as lines for the terminal, as Markdown, and as a page."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from estimator.blind.leaderboard.figures import (
    BLOCK,
    CALIBRATION,
    FALSE_ALARMS,
    LOG_SCORE,
    MODULUS,
    SECONDS,
    TOP_1,
)
from estimator.blind.leaderboard.ranking import Leaderboard, Ranked
from estimator.blind.scoring.labels import FAMILIES
from estimator.blind.scoring.scored import Metric
from estimator.errors import InputError
from estimator.report import page

_HEADLINES = (LOG_SCORE, TOP_1, BLOCK, FALSE_ALARMS, CALIBRATION, MODULUS, SECONDS)


@dataclass(frozen=True, slots=True)
class Table:
    """A caption and rows of cells, the head first."""

    caption: str
    rows: tuple[tuple[str, ...], ...]


def leaderboard_text(board: Leaderboard) -> str:
    """Return lines for the terminal."""
    lines = [_summary(board)]
    for table in _tables(board):
        widths = [max(map(len, column)) for column in zip(*table.rows, strict=True)]
        lines += ["", table.caption]
        lines += ["  ".join(map(str.ljust, row, widths)).rstrip() for row in table.rows]
    return "\n".join([*lines, "", *_entries(board)])


def check_writable(path: Path) -> None:
    """Check the name of a file before the keys are opened for it.

    Raises
    ------
    InputError
        It ends neither in ``.md`` nor in ``.html``.
    """
    if path.suffix not in (".md", ".html"):
        raise InputError(f"{path}: a leaderboard is written as .md or .html; choose one of them")


def write_leaderboard(board: Leaderboard, path: Path) -> None:
    """Write the leaderboard as Markdown (``.md``) or as a page (``.html``)."""
    check_writable(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(_markdown(board) if path.suffix == ".md" else _html(board), encoding="utf-8")


def _markdown(board: Leaderboard) -> str:
    blocks = ["# Leaderboard", _summary(board)]
    for table in _tables(board):
        head, *rows = ("| " + " | ".join(_escaped(cell) for cell in row) + " |" for row in table.rows)
        rule = "| " + " | ".join("---" for _ in table.rows[0]) + " |"
        blocks += [f"## {table.caption}", "\n".join([head, rule, *rows])]
    return (
        "\n\n".join([*blocks, "## The entries", *(f"* {_escaped(line)}" for line in _entries(board))]) + "\n"
    )


def _html(board: Leaderboard) -> str:
    blocks = [page.headline(_summary(board))]
    for table in _tables(board):
        blocks += [page.heading(table.caption), page.table("", table.rows[0], table.rows[1:])]
    blocks += [page.heading("The entries"), *map(page.paragraph, _entries(board))]
    return page.page("Leaderboard", blocks)


def _summary(board: Leaderboard) -> str:
    kinds = ", ".join(f"{count} {kind}" for kind, count in board.cases.items())
    times = "once" if board.openings.count == 1 else f"{board.openings.count} times"
    since = f", first at {board.openings.first.isoformat()}" if board.openings.first else ""
    return (
        f"{sum(board.cases.values())} cases ({kinds}) of the set {board.set_hash}. The keys have been opened "
        f"{times}{since}. In brackets: 95 % intervals."
    )


def _tables(board: Leaderboard) -> Iterator[Table]:
    names = [one.entry.name for one in board.ranked]
    ranks = [
        (str(place), one.entry.name, *(_value(_named(one, name)) for name in _HEADLINES), one.standing)
        for place, one in enumerate(board.ranked, start=1)
    ]
    yield Table("By log score", (("", "entry", *_HEADLINES, "answers"), *ranks))
    yield Table("All figures", (("", "cases", *names), *_compared([one.figures for one in board.ranked])))
    for family in FAMILIES:
        found = [one.by_family[family] for one in board.ranked if family in one.by_family]
        if found:
            yield Table(f"Forms that are {family}", (("", "cases", *names), *_compared(found)))


def _compared(found: Sequence[Sequence[Metric]]) -> Iterator[tuple[str, ...]]:
    """Give a row for each figure that any case has, its cells those of the entries."""
    for of_one in zip(*found, strict=True):
        counts = [metric.figure.count for metric in of_one]
        if any(counts):
            yield of_one[0].name, _counted(counts), *(_with_interval(metric) for metric in of_one)


def _counted(counts: Sequence[int]) -> str:
    return str(counts[0]) if len(set(counts)) == 1 else "/".join(map(str, counts))


def _named(one: Ranked, name: str) -> Metric:
    return next(metric for metric in one.figures if metric.name == name)


def _with_interval(metric: Metric) -> str:
    if not metric.figure.count:
        return "–"
    low, high = (_number(end, metric.unit) for end in (metric.figure.low, metric.figure.high))
    return f"{_value(metric)} ({low} to {high})"


def _value(metric: Metric) -> str:
    if not metric.figure.count:
        return "–"
    unit = f" {metric.unit}" if metric.unit else ""
    return f"{_number(metric.figure.value, metric.unit)}{unit}"


def _number(value: float, unit: str) -> str:
    if unit == "%":
        return f"{100 * value:.0f}" if abs(value) >= 0.1 or not value else f"{100 * value:.1f}"
    return f"{value:.3g}" if unit else f"{value:.3f}"


def _entries(board: Leaderboard) -> Iterator[str]:
    for one in board.ranked:
        method = " ".join(one.entry.method.split())
        yield (
            f"{one.entry.name}: {method} Answered {one.entry.answered.isoformat()}, SHA-256 "
            f"{one.entry.answers_hash}, {one.standing}."
        )


def _escaped(text: str) -> str:
    """Return text that Markdown shows as it is, whatever an entry calls itself."""
    for mark in "\\`*_[]<>|#":
        text = text.replace(mark, f"\\{mark}")
    return text
