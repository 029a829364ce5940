"""The page and the pictures of studies."""

import json
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

import matplotlib
from matplotlib.figure import Figure

from estimator.report import page
from estimator.report.page import Html
from estimator.report.theme import COLOURS, PLOT_STYLE
from estimator.studies.tables.plot import draw_study, figure_size
from estimator.studies.tables.study import StudyResult
from estimator.studies.tables.telling import HEAD, failures, study_json, table_rows

PAGE_FILE = "studies.html"
_DPI = 130
_CAPTION = (
    "Every mark is one estimate, bars are mean and standard deviation over the draws, diamonds the paper's."
)


def write_studies(
    results: Sequence[StudyResult],
    folder: Path,
    provenance: Mapping[str, str],
    further: Sequence[Html] = (),
) -> list[Path]:
    """Write one page, with further blocks at its end, and for each study a picture and its data; return the files."""
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / PAGE_FILE]
    blocks = [block for result in results for block in _blocks(result)]
    text = page.page("Studies", [*blocks, *further, page.facts("Made with", provenance)])
    files[0].write_text(text, encoding="utf-8")
    for result in results:
        picture = folder / f"{result.study.name}.png"
        _write_picture(result, picture)
        data = folder / f"{result.study.name}.json"
        data.write_text(json.dumps(study_json(result), indent=1), encoding="utf-8")
        files += [picture, data]
    return files


def _blocks(result: StudyResult) -> list[Html]:
    tables = [page.table(group.group.title, HEAD, table_rows(group)) for group in result.groups]
    return [
        page.heading(result.study.title),
        *(page.note(note) for note in result.study.notes),
        page.figure(partial(draw_study, result=result), figure_size(result), _CAPTION),
        *tables,
        page.warnings([f"no estimate: {failure}" for failure in failures(result)]),
    ]


def _write_picture(result: StudyResult, file: Path) -> None:
    with matplotlib.rc_context(PLOT_STYLE):
        sheet = Figure(figsize=figure_size(result))
        draw_study(sheet, result)
        sheet.savefig(file, dpi=_DPI, facecolor=COLOURS["paper"].light)
