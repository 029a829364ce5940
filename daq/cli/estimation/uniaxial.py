"""``retract uniaxial``: fit material laws to a tensile or compression test."""

import argparse
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from daq.cli.file_options import SIZES, add_what_a_file_may_leave_open
from daq.cli.verb import Result, Verbs, add_verb
from estimator.materials import installed_laws, law_named
from estimator.uniaxial import (
    Comparison,
    Rung,
    Stated,
    UniaxialRecord,
    as_json,
    as_text,
    compare_runs,
    fit_record,
    read_record,
    stated_quantity,
    stiffening_ladder,
    stiffens_from,
    write_report,
)

_EXAMPLES = """  retract uniaxial tests/ecoflex_tension.csv
  retract uniaxial tests/ecoflex_tension.csv --slack 0.08 --output runs/ecoflex
  retract uniaxial tests/ecoflex_tension.csv --law gent yeoh2 --strain-fit 0.5 --strain-test 1.0
  retract uniaxial tests/ecoflex_tension.csv --stiffening
  retract uniaxial tests/load_travel.csv --gauge-length "20 mm" --width "10 mm" --thickness "2 mm"
  retract uniaxial tests/specimens.xlsx --specimen 2 --mode compression --stress-unit kPa
  retract uniaxial tests/run1.csv --against tests/run2.csv tests/run3.csv"""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "uniaxial", "fit material laws to a tensile or compression test", _EXAMPLES, run)
    parser.add_argument(
        "record",
        type=Path,
        metavar="FILE",
        help="stress and strain, or load and travel, as a testing machine exports them: text or .xlsx",
    )
    parser.add_argument(
        "--law",
        nargs="+",
        action="extend",
        metavar="NAME",
        help=f"of {', '.join(installed_laws())} (default: all)",
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
        "--stiffening",
        action="store_true",
        help="tell from which strain on a stiffening law predicts larger strains better",
    )
    parser.add_argument(
        "--against",
        type=Path,
        nargs="+",
        default=[],
        metavar="RUN",
        help="tell whether other runs of the test differ by more than repeats do, and in what",
    )
    parser.add_argument(
        "--output", type=Path, metavar="DIR", help="write an HTML page and a plot into this folder"
    )
    add_what_a_file_may_leave_open(parser, ("tension", "compression"))


def stated_by(options: argparse.Namespace) -> Stated:
    """Return what the options of :func:`add_what_a_file_may_leave_open` say; shear is no mode of a uniaxial test."""
    sizes = {
        option.replace("-", "_"): stated_quantity(text, dimension, f"--{option}")
        for option, (_, dimension) in SIZES.items()
        if (text := getattr(options, option.replace("-", "_"))) is not None
    }
    return Stated(
        mode=None if options.mode == "shear" else options.mode,
        strain_unit=options.strain_unit,
        stress_unit=options.stress_unit,
        force_unit=options.force_unit,
        length_unit=options.length_unit,
        specimen=options.specimen,
        decimal=options.decimal,
        keep_zero=options.keep_zero,
        **sizes,
    )


def run(options: argparse.Namespace) -> Result:
    """Fit the laws, and tell their ranking."""
    stated = stated_by(options)
    record = read_record(options.record, stated)
    runs = [read_record(path, stated) for path in options.against]
    fit = fit_record(
        record,
        [law_named(name) for name in dict.fromkeys(options.law or installed_laws())],
        strain_from=options.strain_from,
        strain_fit=options.strain_fit,
        strain_test=options.strain_test,
        slack_limit=options.slack,
    )
    text, data = as_text(fit), as_json(fit)
    if options.stiffening:
        text, data = _with_stiffening(text, data, record)
    if runs:
        comparisons = [compare_runs(record, run) for run in runs]
        text = "\n".join([text, "", *(_told(comparison) for comparison in comparisons)])
        data = {**data, "against": [asdict(comparison) for comparison in comparisons]}
    if options.output is not None:
        report = write_report(fit, options.output)
        text, data = f"{text}\n\n{report}", {**data, "report": str(report)}
    return Result(text, data)


def _with_stiffening(
    text: str, data: Mapping[str, Any], record: UniaxialRecord
) -> tuple[str, dict[str, Any]]:
    ladder = stiffening_ladder(record)
    onset = stiffens_from(ladder)
    verdict = (
        "No stiffening is borne out by the strains left out of the fit."
        if onset is None
        else f"Stiffening is borne out where strains up to {onset:g} or more are fitted."
    )
    rows = [{**asdict(rung), "claimed": rung.claimed} for rung in ladder]
    return (
        "\n".join([text, "", verdict, *(_step(rung) for rung in ladder)]),
        {**data, "stiffening": {"from": onset, "ranges": rows}},
    )


def _step(rung: Rung) -> str:
    return (
        f"  fitted to {rung.strain_fit:g}, held against {rung.strain_test:g}: {rung.law} takes "
        f"{round(100 * rung.closure_fit)} % off the Neo-Hookean error within, "
        f"{round(100 * rung.closure_held_out)} % beyond"
    )


def _told(comparison: Comparison) -> str:
    return (
        f"{comparison.second} against {comparison.first}: {comparison.verdict}; they differ by "
        f"{100 * comparison.gap:.2g} %, {round(100 * comparison.closure_held_out)} % of it by "
        f"{comparison.size:+.2g} ({comparison.unit})"
    )
