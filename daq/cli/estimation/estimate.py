"""``retract estimate``: the parameters of the tissue from experiments of one phantom."""

import argparse
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

from daq.cli.estimation.known import add_known_options, material_settings_of, with_noise_of
from daq.cli.estimation.uncertainties import add_uncertainty_option, stated_of
from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.rig import read_rig
from daq.versions import package_versions
from estimator.errors import InputError
from estimator.experiment import Experiment, read_experiment
from estimator.experiment_checks.suspicions import naming_suspicions, suspicions_of
from estimator.fit.budget.systematic import Stated
from estimator.fit.estimate import estimate
from estimator.fit.losses import LOSSES, loss_named
from estimator.fit.nuisances import NUISANCES, USUAL
from estimator.fit.online import follow
from estimator.fit.settings import OBJECTIVES, FitSettings
from estimator.forward.meshing import surface_notes
from estimator.report.estimation.budget import budget_text
from estimator.report.estimation.findings import step_text, summary_text
from estimator.report.estimation.writing import write_report

_EXAMPLES = """  retract estimate experiments/pull
  retract estimate experiments/pull --report runs/pull.html
  retract estimate experiments/pull experiments/twist_and_pull --json
  retract estimate experiments/pull --law yeoh2 --fix poisson_ratio=0.49 --bounds c2=0:1
  retract estimate experiments/pull --prior youngs_modulus=15000+-2000 --loss huber --profile
  retract estimate experiments/pull --noise force_std=0.05 --prior poisson_ratio=none
  retract estimate experiments/pull --nuisances tare,rest_positions --objective paper
  retract estimate experiments/pull --follow
  retract estimate experiments/pull --budget --uncertainty force_gain=0.005 --report runs/pull.html

Every parameter of the law is estimated that is not fixed: youngs_modulus (Pa), poisson_ratio, those of its shape."""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "estimate", "estimate Young's modulus and Poisson's ratio", _EXAMPLES, run)
    parser.add_argument("--report", type=Path, metavar="FILE", help="write an HTML page")
    add_known_options(parser)
    parser.add_argument(
        "--loss",
        choices=tuple(LOSSES),
        default="linear",
        help="of residuals: huber and cauchy give outliers little weight (default: %(default)s)",
    )
    parser.add_argument(
        "--nuisances",
        metavar="LIST",
        default=",".join(name for name in NUISANCES if name in USUAL),
        help=f"what is unknown besides, of {', '.join(NUISANCES)}, or none (default: %(default)s)",
    )
    parser.add_argument(
        "--objective",
        choices=OBJECTIVES,
        default="likelihood",
        help="paper: unweighted squares with the automatic scale factor, by SQP (default: %(default)s)",
    )
    parser.add_argument("--profile", action="store_true", help="intervals by profile likelihood")
    parser.add_argument(
        "--budget",
        action="store_true",
        help="which uncertainty contributes how much to the deviations, and which device to improve",
    )
    parser.add_argument(
        "--rig",
        type=Path,
        metavar="FILE",
        help="rig file, whose calibrations tell how large uncertainties of the budget are",
    )
    add_uncertainty_option(parser)
    parser.add_argument(
        "--follow",
        action="store_true",
        help="go through one experiment as if it ran, and tell the estimate after each step and the time it took",
    )
    parser.add_argument(
        "experiments", type=Path, nargs="+", metavar="EXPERIMENT", help="experiment folders of one phantom"
    )


def run(options: argparse.Namespace) -> Result:
    """Estimate, and tell the parameters."""
    if not options.budget and (options.rig is not None or options.uncertainty):
        raise InputError(
            "--rig and --uncertainty are of the budget; ask for it with --budget, or leave them out"
        )
    settings = settings_of(options)
    experiments = with_noise_of(options, [read_experiment(path) for path in options.experiments])
    if options.follow:
        return _followed(experiments, options, settings)
    with progress() as tell, naming_suspicions(options.experiments):
        found = estimate(experiments, tell, settings)
    if options.report is not None:
        write_report(
            found,
            options.report,
            title="Estimation of " + ", ".join(experiment.name for experiment in experiments),
            truth=None,
            provenance={"experiments": ", ".join(map(str, options.experiments)), **package_versions()},
        )
    notes, suspicions = surface_notes(experiments[0]), suspicions_of(options.experiments)
    told = [*(f"Surface: {note}" for note in notes), *(f"Suspicious: {one}" for one in suspicions)]
    budget = [] if found.budget is None else ["", budget_text(found.budget)]
    text = "\n".join([summary_text(found, None), *told, *budget])
    return Result(text, {**found.as_json(), "surface": notes, "suspicious": suspicions})


def _followed(
    experiments: Sequence[Experiment], options: argparse.Namespace, settings: FitSettings
) -> Result:
    if len(experiments) > 1 or options.report is not None or options.budget:
        raise InputError(
            "--follow goes through one experiment, and writes neither report nor budget; leave the rest out"
        )
    steps = []
    with progress() as tell:
        for found in follow(experiments[0], settings):
            steps.append(found)
            tell("following", found.step, found.step)
    if not steps:
        raise InputError(
            f"{options.experiments[0]}: the gripper does not move in it; name an experiment with a motion"
        )
    lines = [f"step {found.step}: {step_text(found)}; {found.seconds:.2f} s" for found in steps]
    slowest = max(found.seconds for found in steps)
    return Result(
        "\n".join([*lines, f"slowest step {slowest:.2f} s"]),
        {"steps": [asdict(found) for found in steps], "slowest_seconds": slowest},
    )


def settings_of(options: argparse.Namespace) -> FitSettings:
    """Return what the options ask for.

    Raises
    ------
    InputError
        An option is not written as its help says, or names what there is not.
    """
    named = options.nuisances.split(",") if options.nuisances not in ("", "none") else []
    return replace(
        material_settings_of(options),
        loss=loss_named(options.loss),
        nuisances=frozenset(named),
        objective=options.objective,
        intervals="profile" if options.profile else "linear",
        budget=_stated(options) if options.budget else None,
    )


def _stated(options: argparse.Namespace) -> Stated:
    rig = None if options.rig is None else read_rig(options.rig, to_connect=False)
    return stated_of(options, rig)
