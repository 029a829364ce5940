"""A diagnosis of bench tests as a page that needs no network, with its picture."""

import json
from functools import partial
from itertools import cycle
from pathlib import Path
from typing import TypeAlias

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from estimator.report import page
from estimator.report.drawing.marks import plot_measured
from estimator.report.theme import COLOURS, MEASURED, MUTED, PLOT_STYLE, PREDICTED, TRUTH
from estimator.uniaxial.diagnosis.causes import NONE
from estimator.uniaxial.diagnosis.result import BenchDiagnosis, Course
from estimator.uniaxial.diagnosis.telling import as_json, closure, moduli, shown, summary
from estimator.uniaxial.diagnosis.verdict import named

_Line: TypeAlias = str | tuple[int, tuple[float, ...]]
PAGE_FILE, DATA_FILE, PICTURE_FILE = "diagnosis.html", "diagnosis.json", "diagnosis.png"
_SIZE_IN = (11.4, 4.4)
_PNG_DPI = 150
_MOST_BARS = 8
_LINES: tuple[_Line, ...] = ("-", (0, (4, 2)), (0, (1, 1.5)), (0, (4, 1, 1, 1)))


def write_report(found: BenchDiagnosis, folder: Path | str) -> Path:
    """Write ``diagnosis.html``, ``diagnosis.json`` and ``diagnosis.png``; return the page's path."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    draw = partial(_draw, found=found)
    blocks = [
        page.headline(summary(found)),
        page.figure(
            draw,
            _SIZE_IN,
            "Stress over strain, measured, of the Neo-Hookean law and with the causes that come nearest; what each "
            "leaves of the measured stress, row by row; and how probable each answer is.",
        ),
        page.note(f"{moduli(found)}. {closure(found)}."),
    ]
    if found.sizes:
        cells = [
            (
                f"{named((s.label,))}: {s.name.replace('_', ' ')}",
                _number(s.value),
                _interval(s.low, s.high),
                s.unit,
            )
            for s in found.sizes
        ]
        blocks.append(page.table("How large", ("", "value", "one deviation", "unit"), cells))
    if found.next_tests:
        blocks.extend([page.heading("What would tell more"), page.warnings(found.next_tests)])
    blocks.append(page.table("How the tests were read", ("", ""), _how_read(found)))
    report = target / PAGE_FILE
    title = f"Diagnosis of {', '.join(test.name for test in found.tests)}"
    report.write_text(page.page(title, blocks), encoding="utf-8")
    (target / DATA_FILE).write_text(json.dumps(as_json(found), indent=1), encoding="utf-8")
    with matplotlib.rc_context(PLOT_STYLE):
        sheet = Figure(figsize=_SIZE_IN)
        draw(sheet)
        sheet.savefig(target / PICTURE_FILE, dpi=_PNG_DPI, facecolor=COLOURS["paper"].light)
    return report


def _draw(sheet: Figure, found: BenchDiagnosis) -> None:
    curve, rest, bars = sheet.subplots(1, 3, width_ratios=(1.1, 1.1, 1.0))
    sheet.subplots_adjust(left=0.055, right=0.985, bottom=0.13, top=0.86, wspace=0.24)
    explained = found.nearest != (NONE,)
    begin = 0
    for number, (course, style) in enumerate(zip(found.courses, cycle(_LINES), strict=False)):
        _draw_course(curve, course, style, explained=explained)
        rows = np.arange(begin, begin + len(course.before))
        lines = [(course.before, MUTED, style), (course.after, PREDICTED, style)][: 1 + explained]
        for values, colour, _ in lines:
            rest.plot(rows, (values - course.rows.stress) / 1e3, color=colour)
        begin += len(course.before)
        if number < len(found.courses) - 1:
            rest.axvline(begin - 0.5, color=MUTED, linewidth=0.7)
    rest.axhline(0.0, color=MEASURED, linewidth=0.8)
    mode = "amount of shear" if found.tests[0].mode == "shear" else found.tests[0].mode
    curve.set_xlabel(f"{mode}, %")
    curve.set_ylabel("nominal stress, kPa")
    rest.set_xlabel("row, in the order of the test")
    rest.set_ylabel("law less measured, kPa")
    _draw_bars(bars, found)
    handles, labels = curve.get_legend_handles_labels()
    first = dict(reversed(list(zip(labels, handles, strict=True))))
    order = [label for label in dict.fromkeys(labels) if label in first]
    sheet.legend([first[one] for one in order], order, loc="upper left", ncols=3, borderaxespad=0.2)


def _draw_course(axes: Axes, course: Course, style: _Line, *, explained: bool) -> None:
    percent = 100 * course.rows.strain
    plot_measured(axes, percent, course.rows.stress / 1e3, size=3.0)
    axes.plot(percent, course.before / 1e3, color=MUTED, linestyle=style, label="Neo-Hookean")
    if explained:
        axes.plot(
            percent, course.after / 1e3, color=PREDICTED, linestyle=style, label="with the nearest causes"
        )


def _draw_bars(axes: Axes, found: BenchDiagnosis) -> None:
    answers = shown(found)[:_MOST_BARS]
    plausible = (found.verdict, *found.alike)
    places = np.arange(len(answers))[::-1]
    colours = [TRUTH if answer in plausible else MUTED for answer, _ in answers]
    axes.barh(places, [100 * p for _, p in answers], color=colours, height=0.35)
    for place, (answer, p) in zip(places, answers, strict=True):
        axes.text(0.0, place + 0.25, f"{named(answer)}, {round(100 * p)} %", fontsize=8, va="bottom")
    axes.set_xlim(0, 100)
    axes.set_ylim(-0.5, max(len(answers), 4) - 0.2)
    axes.set_yticks([])
    axes.set_xlabel("probability, %")


def _number(value: float) -> str:
    return f"{value:.3g}"


def _interval(low: float, high: float) -> str:
    return f"{_number(low)} to {_number(high)}"


def _how_read(found: BenchDiagnosis) -> list[tuple[str, str]]:
    told = []
    for test in found.tests:
        told.append((test.name, f"{test.mode}, {len(test.strain)} rows"))
        told += [("found", one) for one in test.found]
        told += [("assumed", one) for one in test.assumed]
        told += [("left out", one) for one in test.left_out]
    return [*told, *(("not tried", one) for one in found.not_tried)]
