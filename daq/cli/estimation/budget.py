"""``retract budget``: how well a rig and a plan will tell the tissue's parameters, before anything is recorded."""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from daq.cli.estimation.known import add_known_options, material_settings_of, with_noise_of
from daq.cli.estimation.uncertainties import add_uncertainty_option, stated_of
from daq.cli.rigs import add_rig, opened_rig
from daq.cli.sessions.record import trajectory_name
from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.plans import Trial, read_plan
from daq.rig import Rig
from daq.trajectories.planned import moves, planned_experiment
from daq.trajectories.routines import RETRACTIONS
from daq.trajectories.trajectory import Trajectory
from daq.uncertainties import PlannedNoise, as_measured, planned_noise
from daq.versions import package_versions
from estimator.errors import InputError
from estimator.experiment import Experiment
from estimator.fit.estimate import estimate
from estimator.fit.settings import material_of
from estimator.forward.gradings import DEFAULT_GRADING
from estimator.report.estimation.budget import budget_text
from estimator.report.estimation.writing import write_report
from estimator.simulation.simulate import Resolution, simulate_exactly

_EXAMPLES = """  retract budget lab.toml --trajectory pull
  retract budget lab.toml --plan plan.toml --youngs-modulus 6000 --poisson-ratio 0.47
  retract budget lab.toml --trajectory pull --trajectory twist_and_pull --uncertainty force_gain=0.005
  retract budget lab.toml --trajectory pull --noise force_std=0.05 --json

No device is connected. The rig's drivers, calibrations and specimen tell the sizes; what nobody tells is assumed, and
said so. Rows are the measuring windows of the trajectories. 'retract estimate --budget' does the same with what was
recorded."""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(
        verbs, "budget", "tell how well a rig and a plan will determine E and ν", _EXAMPLES, run
    )
    add_rig(parser)
    chosen = parser.add_mutually_exclusive_group(required=True)
    chosen.add_argument(
        "--trajectory",
        type=trajectory_name,
        action="append",
        help=f"{', '.join(RETRACTIONS)}; or a table FILE.csv, or a function FILE.py:NAME; repeat for several",
    )
    chosen.add_argument(
        "--plan", type=Path, metavar="FILE", help="the trials of a plan file, with their repeats"
    )
    parser.add_argument(
        "--youngs-modulus", type=float, default=15e3, metavar="PA", help="presumed (default: %(default)s)"
    )
    parser.add_argument(
        "--poisson-ratio", type=float, default=0.45, metavar="NU", help="presumed (default: %(default)s)"
    )
    parser.add_argument("--report", type=Path, metavar="FILE", help="write an HTML page")
    add_known_options(parser)
    add_uncertainty_option(parser)


def run(options: argparse.Namespace) -> Result:
    """Rehearse the plan without noise, estimate from it, and tell the budget."""
    law = material_settings_of(options)
    with opened_rig(options.rig) as rig:
        trajectories = _trajectories(options)
        measured_s = min(step.measure_s for one in trajectories for step in one.steps)
        noise = planned_noise(rig, measured_s)
        stated = stated_of(options, rig)
        planned = _planned(rig, trajectories, noise)
    planned = with_noise_of(options, planned)
    settings = replace(law, budget=replace(stated, origins={**noise.origins, **stated.origins}))
    presumed = {"youngs_modulus": options.youngs_modulus, "poisson_ratio": options.poisson_ratio}
    material = material_of(law.law, {**law.start, **presumed, **law.fixed})
    with progress() as tell:
        rehearsed = simulate_exactly(
            planned,
            material,
            progress=partial(tell, "solving the equilibria"),
            resolution=Resolution(DEFAULT_GRADING, "hex27"),
        )
        found = estimate([as_measured(rig, one) for one in rehearsed], tell, settings)
    assert found.budget is not None
    what = ", ".join(one.name for one in planned)
    if options.report is not None:
        title = f"Expected uncertainty of {what}"
        write_report(found, options.report, title=title, truth=None, provenance=package_versions())
    text = f"Expected for {what} on rig {rig.name!r}, with E = {presumed['youngs_modulus'] / 1e3:g} kPa and "
    text += f"ν = {presumed['poisson_ratio']:g}:"
    return Result(
        f"{text}\n{budget_text(found.budget)}", {"presumed": presumed, "budget": found.budget.as_json()}
    )


def _trajectories(options: argparse.Namespace) -> list[Trajectory]:
    if options.plan is not None:
        plan = read_plan(options.plan)
        return [trial.lay_out(options.plan.parent) for trial in plan.trials for _ in range(trial.repeat)]
    return [Trial(name).lay_out(Path()) for name in options.trajectory]


def _planned(rig: Rig, trajectories: Sequence[Trajectory], noise: PlannedNoise) -> list[Experiment]:
    """Return a row for every measuring window, as a recording would have."""
    planned = [
        planned_experiment(trajectory, rig.specimen, noise.sensor, order, rows_per_move=0)
        for order, trajectory in enumerate(trajectories, start=1)
    ]
    for experiment in planned:
        if not moves(experiment):
            raise InputError(
                f"{experiment.name}: the gripper never leaves its pose at rest; let a step lead elsewhere"
            )
    return planned
