"""Tensile and compression tests: records, laws fitted to them, and their report."""

from estimator.uniaxial.fit import RankedLaw, UniaxialFit, fit_record
from estimator.uniaxial.law_fit import Estimate, LawFit, fit_law
from estimator.uniaxial.records import UniaxialRecord, read_record
from estimator.uniaxial.report import as_json, as_text, write_report

__all__ = [
    "Estimate",
    "LawFit",
    "RankedLaw",
    "UniaxialFit",
    "UniaxialRecord",
    "as_json",
    "as_text",
    "fit_law",
    "fit_record",
    "read_record",
    "write_report",
]
