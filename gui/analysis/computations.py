"""The computations that the pages start: functions of plain values, carried out in processes of their own."""

import json
from collections.abc import Sequence
from pathlib import Path

from daq.export import export_experiment, export_tables
from daq.export.table_formats import FORMATS
from daq.recording.reader import Recording
from daq.recording.recovery import recover_session
from daq.session_report import SessionReport, write_report
from daq.versions import package_versions
from estimator.diagnosis.conclusions.as_json import as_json
from estimator.diagnosis.diagnose import diagnose
from estimator.diagnosis.noise.errors_left import ErrorsLeft
from estimator.diagnosis.result import Consideration, Diagnosis
from estimator.diagnosis.what_if import what_if
from estimator.errors import InputError
from estimator.fit.estimate import estimate
from estimator.fit.result import Estimate
from estimator.fit.settings import FitSettings
from estimator.materials import law_named
from gui.analysis.sources import experiments_of, stated_by
from gui.jobs.process import Reporter

EXPERIMENT = "experiment"
EXPORTS: tuple[str, ...] = (EXPERIMENT, *FORMATS)
"""What a session can be exported as: the synchronised experiment folder, and its streams as tables."""


def estimate_sources(report: Reporter, sources: Sequence[Path], law: str) -> Estimate:
    """Estimate the parameters of a law from sessions and experiment folders of one phantom, with their budget."""
    settings = FitSettings(law=law_named(law), budget=stated_by(sources))
    return estimate(experiments_of(sources, report), report, settings)


def diagnose_sources(report: Reporter, sources: Sequence[Path]) -> Diagnosis:
    """Diagnose sessions and experiment folders of one phantom."""
    return diagnose(experiments_of(sources, report), report)


def try_cause(
    report: Reporter, sources: Sequence[Path], label: str, floor: float, errors_left: ErrorsLeft
) -> Consideration:
    """Fit the model with one cause in it, with the noise of the diagnosis that it is to stand in."""
    return what_if(experiments_of(sources, report), label, floor, errors_left, report)


def write_estimate_page(report: Reporter, found: Estimate, page: Path) -> Path:
    """Write the report of an estimation, and its numbers beside it; return the page."""
    from estimator.report.estimation.writing import write_report as write_page

    _require_new(page)
    report("writing the report", 0, 1)
    names = ", ".join(fit.experiment.name for fit in found.fits)
    provenance = {"experiments": names, **package_versions()}
    write_page(found, page, title=f"Estimation of {names}", truth=None, provenance=provenance)
    page.with_suffix(".json").write_text(json.dumps(found.as_json(), indent=1), encoding="utf-8")
    return page


def write_diagnosis_page(report: Reporter, found: Diagnosis, page: Path) -> Path:
    """Write the report of a diagnosis, and its numbers beside it; return the page."""
    from estimator.report.diagnosis.writing import write_report as write_page

    _require_new(page)
    report("writing the report", 0, 1)
    first = found.traces[0].experiment
    provenance = {"experiments": ", ".join(found.by_experiment), **package_versions()}
    write_page(found, page, title=f"Diagnosis of {first.phantom_id}", provenance=provenance)
    page.with_suffix(".json").write_text(json.dumps(as_json(found), indent=1), encoding="utf-8")
    return page


def export_session(report: Reporter, session: Path, form: str, target: Path) -> str:
    """Export a session in one of :data:`EXPORTS` to a new file or folder; return what came out, in a line."""
    if form == EXPERIMENT:
        experiment, _ = export_experiment(session, target, report)
        return f"{len(experiment.time)} synchronised rows in {target}"
    exported = export_tables(session, form, target, report)
    rows = ", ".join(f"{name} {count}" for name, count in exported.rows.items())
    missing = f"; no synchronised table: {exported.unsynchronised}" if exported.unsynchronised else ""
    return f"{target}: rows of {rows}{missing}"


def repair_session(report: Reporter, session: Path) -> str:
    """Recover a session that was cut off and judge it; return what was kept, in a line."""
    report("saving what was recorded", 0, 2)
    recovery = recover_session(session)
    report("judging the recording", 1, 2)
    write_report(Recording(session), report)
    kept = sum(recovery.info.samples.values())
    lost = ", ".join(f"{stream} {loss}" for stream, loss in recovery.lost.items() if loss.samples)
    return (
        f"{kept} samples kept; {recovery.left_out_bytes} bytes could not be used; lost: {lost or 'no sample'}"
    )


def judge_session(report: Reporter, session: Path) -> SessionReport:
    """Judge a sealed recording anew and keep the report in its folder."""
    return write_report(Recording(session), report)


def _require_new(page: Path) -> None:
    if page.exists():
        raise InputError(f"{page}: exists already; name a new file")
