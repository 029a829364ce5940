"""``retract uniaxial``: fit material laws to a tensile or compression test."""

import argparse
from pathlib import Path

from daq.cli.verb import Result, Verbs, add_verb
from estimator.materials import LAWS, law_named
from estimator.uniaxial import as_json, as_text, fit_record, read_record, write_report

_EXAMPLES = """  retract uniaxial tests/ecoflex_tension.csv
  retract uniaxial tests/ecoflex_tension.csv --slack 0.08 --output runs/ecoflex
  retract uniaxial tests/ecoflex_tension.csv --law gent yeoh2 --strain-fit 0.5 --strain-test 1.0"""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "uniaxial", "fit material laws to a tensile or compression test", _EXAMPLES, run)
    parser.add_argument("record", type=Path, metavar="FILE", help="stress-strain record")
    parser.add_argument(
        "--law",
        nargs="+",
        action="extend",
        metavar="NAME",
        help=f"of {', '.join(LAWS)} (default: all)",
    )
    parser.add_argument(
        "--strain-from",
        type=float,
        default=0.0,
        metavar="STRAIN",
        help="fit from this magnitude of strain (default: %(default)s)",
    )
    parser.add_argument(
        "--strain-fit",
        type=float,
        metavar="STRAIN",
        help="fit up to this one (default: 0.5 in tension, 0.2 in compression)",
    )
    parser.add_argument(
        "--strain-test",
        type=float,
        metavar="STRAIN",
        help="hold the laws against the rows from there up to this one (default: twice as far)",
    )
    parser.add_argument(
        "--slack",
        type=float,
        default=0.0,
        metavar="STRAIN",
        help="find a slack of at most this; 0.08 suits strain of the crosshead (default: %(default)s, none)",
    )
    parser.add_argument(
        "--output", type=Path, metavar="DIR", help="write an HTML page and a plot into this folder"
    )


def run(options: argparse.Namespace) -> Result:
    """Fit the laws, and tell their ranking."""
    fit = fit_record(
        read_record(options.record),
        [law_named(name) for name in dict.fromkeys(options.law or LAWS)],
        strain_from=options.strain_from,
        strain_fit=options.strain_fit,
        strain_test=options.strain_test,
        slack_limit=options.slack,
    )
    text, data = as_text(fit), as_json(fit)
    if options.output is not None:
        report = write_report(fit, options.output)
        text, data = f"{text}\n\n{report}", {**data, "report": str(report)}
    return Result(text, data)
