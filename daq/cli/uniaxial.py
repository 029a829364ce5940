"""``retract uniaxial``: fit material laws to a tensile or compression test."""

import argparse
from pathlib import Path

from daq.cli.verb import Result, Verbs, add_verb
from estimator.uniaxial import as_json, as_text, fit_record, read_record, write_report

_EXAMPLES = """  retract uniaxial tests/ecoflex_tension.csv
  retract uniaxial tests/ecoflex_tension.csv --fit-to 0.5 --test-to 1.0 --report runs/ecoflex"""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "uniaxial", "fit material laws to a tensile or compression test", _EXAMPLES, run)
    parser.add_argument("record", type=Path, metavar="FILE", help="stress-strain record")
    parser.add_argument("--fit-to", type=float, metavar="STRAIN", help="fit up to this magnitude of strain")
    parser.add_argument(
        "--test-to", type=float, metavar="STRAIN", help="test on what lies between, up to this"
    )
    parser.add_argument("--report", type=Path, metavar="DIR", help="write an HTML report into this folder")


def run(options: argparse.Namespace) -> Result:
    """Fit all laws, and tell their ranking."""
    fit = fit_record(read_record(options.record), strain_fit=options.fit_to, strain_test=options.test_to)
    if options.report is not None:
        write_report(fit, options.report)
    return Result(as_text(fit), as_json(fit))
