"""``retract estimate``: Young's modulus and Poisson's ratio from experiments of one phantom."""

import argparse
from pathlib import Path

from daq.cli.verb import Result, Verbs, add_verb, progress
from estimator.experiment import read_experiment
from estimator.fit.estimate import estimate
from estimator.fit.result import Estimate, ParameterEstimate

_EXAMPLES = """  retract estimate experiments/pull
  retract estimate experiments/pull experiments/twist_and_pull --json"""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "estimate", "estimate Young's modulus and Poisson's ratio", _EXAMPLES, run)
    parser.add_argument(
        "experiments", type=Path, nargs="+", metavar="EXPERIMENT", help="experiment folders of one phantom"
    )


def run(options: argparse.Namespace) -> Result:
    """Estimate, and tell the parameters."""
    experiments = [read_experiment(path) for path in options.experiments]
    with progress() as tell:
        found = estimate(experiments, tell)
    return Result(describe(found), found.as_json())


def describe(found: Estimate) -> str:
    """Return the estimate as a few lines."""
    return "\n".join(
        [
            f"Young's modulus  {_words(found.youngs_modulus, 1e-3)} kPa",
            f"Poisson's ratio  {_words(found.poisson_ratio, 1.0)}",
            f"residuals are {found.noise_ratio:.2f} times the sensors' noise; {found.seconds:.1f} s",
        ]
    )


def _words(estimate: ParameterEstimate, scale: float) -> str:
    low, high = (scale * end for end in estimate.interval95)
    return f"{scale * estimate.value:.4f} ± {scale * estimate.std:.4f} (95 %: {low:.4f} to {high:.4f})"
