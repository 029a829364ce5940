"""Tensile and compression tests: records, laws fitted to them, and their report."""

from estimator.uniaxial.fit import RankedLaw, UniaxialFit, fit_record
from estimator.uniaxial.law_fit import Estimate, LawFit, fit_law
from estimator.uniaxial.records import UniaxialRecord, read_record
from estimator.uniaxial.repeats import Comparison, compare_runs
from estimator.uniaxial.report import as_json, as_text, write_report
from estimator.uniaxial.stiffening import Rung, stiffening_ladder, stiffens_from

__all__ = [
    "Comparison",
    "Estimate",
    "LawFit",
    "RankedLaw",
    "Rung",
    "UniaxialFit",
    "UniaxialRecord",
    "as_json",
    "as_text",
    "compare_runs",
    "fit_law",
    "fit_record",
    "read_record",
    "stiffening_ladder",
    "stiffens_from",
    "write_report",
]
