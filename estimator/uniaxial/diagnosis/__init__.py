"""The diagnosis of bench tests: which cause opens the gap between a record and a Neo-Hookean specimen."""

from estimator.uniaxial.diagnosis.bench_test import BenchMode, BenchTest
from estimator.uniaxial.diagnosis.diagnose import diagnose_bench
from estimator.uniaxial.diagnosis.page import write_report
from estimator.uniaxial.diagnosis.result import BenchDiagnosis
from estimator.uniaxial.diagnosis.telling import as_json, as_text

__all__ = ["BenchDiagnosis", "BenchMode", "BenchTest", "as_json", "as_text", "diagnose_bench", "write_report"]
