"""Tensile and compression tests: records, laws fitted to them, and their report."""

from estimator.uniaxial.fit import RankedLaw, UniaxialFit, fit_record
from estimator.uniaxial.law_fit import Estimate, LawFit, fit_law
from estimator.uniaxial.reading import Stated, read_record, stated_quantity
from estimator.uniaxial.records import UniaxialRecord
from estimator.uniaxial.repeats import Comparison, compare_runs
from estimator.uniaxial.report import as_json, as_text, write_report
from estimator.uniaxial.stiffening import Rung, stiffening_ladder, stiffens_from

__all__ = [
    "Comparison",
    "Estimate",
    "LawFit",
    "RankedLaw",
    "Rung",
    "Stated",
    "UniaxialFit",
    "UniaxialRecord",
    "as_json",
    "as_text",
    "compare_runs",
    "fit_law",
    "fit_record",
    "read_record",
    "stated_quantity",
    "stiffening_ladder",
    "stiffens_from",
    "write_report",
]
