"""``retract estimate``: Young's modulus and Poisson's ratio from experiments of one phantom."""

import argparse
from pathlib import Path

from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.versions import package_versions
from estimator.experiment import read_experiment
from estimator.fit.estimate import estimate
from estimator.report.estimation import write_report
from estimator.report.findings import summary_text

_EXAMPLES = """  retract estimate experiments/pull
  retract estimate experiments/pull --report runs/pull.html
  retract estimate experiments/pull experiments/twist_and_pull --json"""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "estimate", "estimate Young's modulus and Poisson's ratio", _EXAMPLES, run)
    parser.add_argument("--report", type=Path, metavar="FILE", help="write an HTML page")
    parser.add_argument(
        "experiments", type=Path, nargs="+", metavar="EXPERIMENT", help="experiment folders of one phantom"
    )


def run(options: argparse.Namespace) -> Result:
    """Estimate, and tell the parameters."""
    experiments = [read_experiment(path) for path in options.experiments]
    with progress() as tell:
        found = estimate(experiments, tell)
    if options.report is not None:
        write_report(
            found,
            options.report,
            title="Estimation of " + ", ".join(experiment.name for experiment in experiments),
            truth=None,
            provenance={"experiments": ", ".join(map(str, options.experiments)), **package_versions()},
        )
    return Result(summary_text(found, None), found.as_json())
