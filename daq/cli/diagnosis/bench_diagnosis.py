"""``retract diagnose FILE...``: the diagnosis of bench tests, whose inputs are files and not folders."""

import argparse

from daq.cli.estimation.uniaxial import stated_by
from daq.cli.verb import Result, progress
from estimator.uniaxial.diagnosis import as_json, as_text, diagnose_bench, write_report
from estimator.uniaxial.reading.whole import read_bench_test


def run_bench(options: argparse.Namespace) -> Result:
    """Diagnose bench tests, and tell the verdict."""
    stated, shear = stated_by(options), options.mode == "shear"
    tests = [read_bench_test(path, stated, shear=shear) for path in options.case]
    with progress() as tell:
        found = diagnose_bench(tests, tell)
    text, data = as_text(found), as_json(found)
    if options.output is not None:
        text += f"\nReport: {write_report(found, options.output)}"
    return Result(text, data)
