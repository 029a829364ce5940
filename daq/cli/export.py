"""``retract export``: synchronise a session and write its experiment folder."""

import argparse
from dataclasses import asdict
from pathlib import Path

from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.export import export_experiment

_EXAMPLES = """  retract export sessions/2026-05-04_143210_P07_pull --output experiments/pull"""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "export", "turn a recorded session into an experiment folder", _EXAMPLES, run)
    parser.add_argument("session", type=Path, metavar="SESSION", help="session folder")
    parser.add_argument(
        "--output", type=Path, required=True, metavar="DIR", help="experiment folder, a new one"
    )


def run(options: argparse.Namespace) -> Result:
    """Export, and tell what came out."""
    with progress() as tell:
        experiment, provenance = export_experiment(options.session, options.output, tell)
    noise = experiment.sensor
    return Result(
        f"{len(experiment.time)} rows in {options.output}; noise of one value: force {noise.force_std * 1e3:.2f} mN, "
        f"torque {noise.torque_std * 1e3:.3f} mN·m, fiducials {noise.fiducial_std * 1e6:.1f} µm",
        {"experiment": str(options.output), "rows": len(experiment.time), "provenance": asdict(provenance)},
    )
