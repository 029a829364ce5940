"""``retract demo``: record one retraction of a virtual laboratory and estimate its phantom."""

import argparse
import time
from dataclasses import asdict, replace
from datetime import datetime
from pathlib import Path

from daq.cli.estimate import describe
from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.export import export_experiment
from daq.rig import make_devices, read_rig
from daq.session.session import Label, connected, run_session
from daq.trajectories import PULL
from daq.virtual_rig.launch import virtual_rig
from daq.virtual_rig.standard import standard_settings
from estimator.fit.estimate import estimate

_EXAMPLES = """  retract demo
  retract demo --output runs/demo --seed 7"""

_PULL = replace(PULL, return_steps=4)


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(
        verbs, "demo", "record a retraction of a virtual laboratory and estimate its phantom", _EXAMPLES, run
    )
    parser.add_argument("--output", type=Path, metavar="DIR", help="a new folder (default: runs/demo_DATE)")
    parser.add_argument("--seed", type=int, default=0, help="of the noise and the beads' places (default: %(default)s)")


def run(options: argparse.Namespace) -> Result:
    """Go through the whole chain: devices, recording, synchronisation, estimation, report."""
    started = time.monotonic()
    folder = options.output or Path("runs") / f"demo_{datetime.now().astimezone():%Y-%m-%d_%H%M%S}"
    rig_folder = folder / "rig"
    rig_folder.mkdir(parents=True)
    settings = standard_settings(options.seed)
    with progress() as tell:
        tell("starting the virtual laboratory", 0, 1)
        with virtual_rig(rig_folder, settings) as running:
            rig = read_rig(running.rig_path)
            with connected(make_devices(rig)) as devices:
                session = folder / "session"
                run_session(rig, devices, _PULL.trajectory(), session, Label("pull"), tell)
        experiment, _ = export_experiment(session, folder / "experiment", tell)
        found = estimate([experiment], tell)
    ...
