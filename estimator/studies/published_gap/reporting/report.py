"""The page, the picture and the data of a diagnosed gap."""

import json
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

import matplotlib
from matplotlib.figure import Figure

from estimator.report import page
from estimator.report.theme import COLOURS, PLOT_STYLE
from estimator.studies.published_gap.diagnosis import GapDiagnosis
from estimator.studies.published_gap.proposals import proposals
from estimator.studies.published_gap.redone import REDONE_HEAD, Redone, redone_json, redone_rows
from estimator.studies.published_gap.reporting import telling
from estimator.studies.published_gap.reporting.drawing import draw_pattern, pattern_size

PAGE_FILE, PICTURE_FILE, DATA_FILE = "gap.html", "gap.png", "gap.json"
_DPI = 130
_CAPTION = (
    "E over the bench test's, and ν, by material and condition: published, and predicted with 90 % intervals of the "
    "mean. Hollow marks are predictions of rows that were neither chosen nor learnt on."
)


def write_gap(
    diagnosis: GapDiagnosis, redone: Sequence[Redone], folder: Path, provenance: Mapping[str, str]
) -> list[Path]:
    """Write page, picture and data; return the files."""
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / name for name in (PAGE_FILE, PICTURE_FILE, DATA_FILE)]
    size = pattern_size(diagnosis)
    blocks = [
        page.headline(proposals(diagnosis)[0]),
        page.figure(partial(draw_pattern, diagnosis=diagnosis), size, _CAPTION),
        page.table("models, locking in each", telling.MODEL_HEAD, telling.model_rows(diagnosis.ranking)),
        page.table("causes", telling.CAUSE_HEAD, telling.cause_rows(diagnosis.ranking)),
        page.table("where causes sit", telling.PLACE_HEAD, telling.place_rows(diagnosis.ranking)),
        page.table("withheld parts", telling.WITHHELD_HEAD, telling.withheld_rows(diagnosis.withheld)),
        page.table("published and predicted", telling.PATTERN_HEAD, telling.pattern_rows(diagnosis)),
        page.table("the estimator's elements alone", telling.LOCKING_HEAD, telling.locking_rows(diagnosis)),
        *(
            [
                page.table(
                    "the experiments redone with the leading model acting", REDONE_HEAD, redone_rows(redone)
                )
            ]
            if redone
            else []
        ),
        page.table("the learnt map, checked", telling.CHECK_HEAD, telling.check_rows(diagnosis.checks)),
        page.heading("What the laboratory should do"),
        *(page.note(line) for line in proposals(diagnosis)),
        page.warnings([f"not simulated: {line}" for line in diagnosis.response.missing]),
        page.facts("Made with", provenance),
    ]
    files[0].write_text(page.page(f"The gap of {diagnosis.table.name}", blocks), encoding="utf-8")
    with matplotlib.rc_context(PLOT_STYLE):
        sheet = Figure(figsize=size)
        draw_pattern(sheet, diagnosis)
        sheet.savefig(files[1], dpi=_DPI, facecolor=COLOURS["paper"].light)
    data = {**telling.gap_json(diagnosis), "redone": redone_json(redone)}
    files[2].write_text(json.dumps(data, indent=1), encoding="utf-8")
    return files
