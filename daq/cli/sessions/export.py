"""``retract export``: synchronise a session and write its experiment folder, or its streams as tables."""

import argparse
from dataclasses import asdict
from pathlib import Path

from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.export import export_experiment, export_ros2, export_tables
from daq.export.table_formats import FORMATS

_EXAMPLES = """  retract export sessions/2026-05-04_143210_P07_pull --output experiments/pull
  retract export sessions/2026-05-04_143210_P07_pull --format hdf5 --output pull.h5
  retract export sessions/2026-05-04_143210_P07_pull --format csv --output tables
  retract export sessions/2026-05-04_143210_P07_pull --format ros2 --output bag"""

_EXPERIMENT = "experiment"
_ROS2 = "ros2"


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "export", "turn a recorded session into an experiment folder", _EXAMPLES, run)
    parser.add_argument("session", type=Path, metavar="SESSION", help="session folder")
    parser.add_argument(
        "--format",
        choices=[_EXPERIMENT, *FORMATS, _ROS2],
        default=_EXPERIMENT,
        help="experiment folder, or one table a stream and the synchronised one, or a rosbag2 folder with standard "
        "messages of ROS 2 alone (default: %(default)s)",
    )
    parser.add_argument(
        "--output",
        type=Path,
        required=True,
        metavar="PATH",
        help="a new folder; a new file for hdf5 and npz",
    )


def run(options: argparse.Namespace) -> Result:
    """Export, and tell what came out."""
    if options.format == _EXPERIMENT:
        return _export_experiment(options)
    return _export_ros2(options) if options.format == _ROS2 else _export_tables(options)


def _export_experiment(options: argparse.Namespace) -> Result:
    with progress() as tell:
        experiment, provenance = export_experiment(options.session, options.output, tell)
    noise = experiment.sensor
    beads = f"fiducials {noise.fiducial_std * 1e6:.1f} µm"
    if not experiment.fiducials.size:
        beads = "no fiducials: one camera measures no place in space, so that wrench and pose alone are there"
    return Result(
        f"{len(experiment.time)} rows in {options.output}; noise of one value: force {noise.force_std * 1e3:.2f} mN, "
        f"torque {noise.torque_std * 1e3:.3f} mN·m, {beads}",
        {"experiment": str(options.output), "rows": len(experiment.time), "provenance": asdict(provenance)},
    )


def _export_tables(options: argparse.Namespace) -> Result:
    with progress() as tell:
        exported = export_tables(options.session, options.format, options.output, tell)
    lines = [f"{rows:9d} rows  {name}" for name, rows in exported.rows.items()]
    if exported.unsynchronised:
        lines.append(f"no synchronised table: {exported.unsynchronised}")
    return Result(
        "\n".join([f"written to {options.output}", *lines]),
        {"output": str(options.output), "format": options.format, **asdict(exported)},
    )


def _export_ros2(options: argparse.Namespace) -> Result:
    with progress() as tell:
        bag = export_ros2(options.session, options.output, tell)
    lines = [f"{count:9d} messages  {topic}" for topic, count in bag.messages.items()]
    if bag.unusable:
        lines.append(f"{bag.unusable} samples that the force sensor forbids to use are left out")
    return Result(
        "\n".join([f"written to {options.output}; stamps are wall-clock time", *lines]),
        {"output": str(options.output), "format": options.format, **asdict(bag)},
    )
