"""What a diagnosis leaves on the disk: a page to read, and its data."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from daq.versions import package_versions
from estimator.diagnosis.conclusions.as_json import as_json
from estimator.diagnosis.noise.refinement import grading_of
from estimator.diagnosis.result import Diagnosis
from estimator.experiment import Experiment
from estimator.fit.settings import FitSettings
from estimator.forward.meshing import surface_notes

PAGE_FILE = "diagnosis.html"
DATA_FILE = "diagnosis.json"


def data_of(found: Diagnosis, experiments: Sequence[Experiment], material: FitSettings) -> dict[str, Any]:
    """Return the data of a diagnosis, with the law and what was done to the phantom's surface."""
    return {
        **as_json(found),
        "law": material.law.name,
        "surface": surface_notes(experiments[0], grading_of(experiments[0])),
    }


def data_text(data: Mapping[str, Any]) -> str:
    """Return the data as the text of their file."""
    return json.dumps(data, indent=1)


def page_of(found: Diagnosis, experiments: Sequence[Experiment], case: str) -> str:
    """Return the page of a diagnosis of the case that was named so."""
    # what draws takes a second to import
    from estimator.report.diagnosis.writing import report_page

    title = f"Diagnosis of {experiments[0].phantom_id}"
    return report_page(found, title=title, provenance={"case": case, **package_versions()})
