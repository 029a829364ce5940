"""``retract demo``: record one retraction of a virtual laboratory and estimate its phantom."""

import argparse
import time
from dataclasses import asdict, replace
from datetime import datetime
from pathlib import Path

from daq.acquisition.client import Acquisition
from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.export import export_experiment
from daq.rig import read_rig
from daq.session.session import Label
from daq.session_report import read_report
from daq.trajectories import PULL
from daq.versions import package_versions
from daq.virtual_rig.launch import virtual_rig
from daq.virtual_rig.standard import POISSON_RATIO, YOUNGS_MODULUS, standard_settings
from estimator.fit.estimate import estimate
from estimator.report.estimation.findings import Truth, summary_text
from estimator.report.estimation.writing import write_report

_EXAMPLES = """  retract demo
  retract demo --output runs/demo --seed 7
  retract demo --depth-camera                one depth camera in the place of the stereo pair"""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(
        verbs, "demo", "record a retraction of a virtual laboratory and estimate its phantom", _EXAMPLES, run
    )
    parser.add_argument(
        "--depth-camera",
        action="store_true",
        help="watch the beads by one depth camera, read through Aravis, instead of a stereo pair",
    )
    parser.add_argument("--output", type=Path, metavar="DIR", help="a new folder (default: runs/demo_DATE)")
    parser.add_argument(
        "--seed", type=int, default=0, help="of the noise and the beads' places (default: %(default)s)"
    )


def run(options: argparse.Namespace) -> Result:
    """Go through the whole chain: devices, recording, synchronisation, estimation, report."""
    started = time.monotonic()
    folder = options.output or Path("runs") / f"demo_{datetime.now().astimezone():%Y-%m-%d_%H%M%S}"
    rig_folder, session, experiment = folder / "rig", folder / "session", folder / "experiment"
    rig_folder.mkdir(parents=True)
    with progress() as tell:
        tell("starting the virtual laboratory, which compiles its solver the first time", 0, 1)
        settings = standard_settings(options.seed)
        if options.depth_camera:
            settings = replace(settings, cameras=1, depth=True)
        with virtual_rig(rig_folder, settings) as running:
            rig = read_rig(running.rig_path)
            with Acquisition(rig) as acquisition:
                acquisition.record(PULL.trajectory(), session, Label("pull"), tell)
        exported, _ = export_experiment(session, experiment, tell)
        found = estimate([exported], tell)
        truth = Truth(YOUNGS_MODULUS, POISSON_RATIO)
        report = folder / "report.html"
        tell("writing the report", 0, 1)
        write_report(
            found,
            report,
            title="Pull of a virtual phantom",
            truth=truth,
            provenance={"session": str(session), "experiment": str(experiment), **package_versions()},
        )
    seconds = time.monotonic() - started
    where = f"report: {report} (with rig, session and experiment beside it, {seconds:.0f} s)"
    recorded = read_report(session)
    return Result(
        "\n".join([summary_text(found, truth), *recorded.pace_lines(), where]),
        {
            "folder": str(folder),
            "report": str(report),
            "truth": asdict(truth),
            "estimate": found.as_json(),
            "seconds": seconds,
            "slowdown": recorded.slowdown,
        },
    )
