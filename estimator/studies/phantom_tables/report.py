"""What recorded phantoms add to the page of studies: their tables in the paper's layout, and its Table VIII."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path

import matplotlib
from matplotlib.figure import Figure

from estimator.report import page
from estimator.report.page import Html
from estimator.report.theme import COLOURS, PLOT_STYLE
from estimator.studies.paper_tables.figures import TABLE_VI, TABLE_VII
from estimator.studies.phantom_tables.bench import BenchTest
from estimator.studies.phantom_tables.curves import curves_size, draw_curves
from estimator.studies.phantom_tables.layout import PAPER_HEAD, Found, anchorings, paper_rows, table_of

CURVES_FILE = "table8.png"
_DPI = 110
_CAPTION = (
    "As the paper's Table VIII: force against time, measured solid and predicted dashed, and paths of the fiducials in "
    "the plane, measured dark and predicted bright."
)


def phantom_blocks(found: Found, bench: Mapping[str, BenchTest]) -> list[Html]:
    """Return the tables and the drawing for the page."""
    blocks = []
    for anchoring in anchorings(found):
        head, rows = table_of(found, anchoring, bench)
        blocks.append(page.table(f"{anchoring} anchored", head, rows))
    blocks.append(page.table("the paper's Table VI, one side anchored", PAPER_HEAD, paper_rows(TABLE_VI)))
    blocks.append(page.table("the paper's Table VII, two sides anchored", PAPER_HEAD, paper_rows(TABLE_VII)))
    if found:
        blocks.append(page.figure(partial(draw_curves, found=found), curves_size(found), _CAPTION))
    return blocks


def write_curves(found: Found, folder: Path) -> list[Path]:
    """Write the drawing; return its file, none where nothing was found."""
    if not found:
        return []
    file = folder / CURVES_FILE
    with matplotlib.rc_context(PLOT_STYLE):
        sheet = Figure(figsize=curves_size(found))
        draw_curves(sheet, found)
        sheet.savefig(file, dpi=_DPI, facecolor=COLOURS["paper"].light)
    return [file]
