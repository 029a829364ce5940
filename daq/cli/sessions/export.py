"""``retract export``: hand a session on: as an experiment folder, tables, a rosbag2, a LeRobot dataset, an RO-Crate."""

import argparse
from dataclasses import asdict
from pathlib import Path

from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.errors import RecordingError
from daq.export import (
    Publication,
    export_experiment,
    export_lerobot,
    export_ro_crate,
    export_ros2,
    export_tables,
)
from daq.export.table_formats import FORMATS

_EXAMPLES = """  retract export sessions/2026-05-04_143210_P07_pull --output experiments/pull
  retract export sessions/2026-05-04_143210_P07_pull --format hdf5 --output pull.h5
  retract export sessions/2026-05-04_143210_P07_pull --format csv --output tables
  retract export sessions/2026-05-04_143210_P07_pull --format ros2 --output bag
  retract export sessions/2026-05-04_* --format lerobot --fps 30 --output dataset
  retract export sessions/2026-05-04_143210_P07_pull --format ro-crate --output crate --licence CC-BY-4.0 \\
      --author "Ada Lovelace <0000-0002-1825-0097>\""""

_EXPERIMENT = "experiment"
_ROS2 = "ros2"
_LEROBOT = "lerobot"
_RO_CRATE = "ro-crate"


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "export", "turn a recorded session into an experiment folder", _EXAMPLES, run)
    parser.add_argument(
        "sessions",
        type=Path,
        nargs="+",
        metavar="SESSION",
        help="session folder; of lerobot several, each an episode",
    )
    parser.add_argument(
        "--format",
        choices=[_EXPERIMENT, *FORMATS, _ROS2, _LEROBOT, _RO_CRATE],
        default=_EXPERIMENT,
        help="experiment folder, or one table a stream and the synchronised one, or a rosbag2 folder with standard "
        "messages of ROS 2 alone, or a LeRobot dataset (v3.0), or an RO-Crate with the session, its experiment and "
        "where both come from (default: %(default)s)",
    )
    parser.add_argument(
        "--fps",
        type=int,
        metavar="N",
        help="of lerobot: frames a second (default: those of the slowest camera)",
    )
    parser.add_argument(
        "--video",
        action="store_true",
        help="of lerobot: images as video, a thousandth of the size (default: without loss, as PNG in Parquet)",
    )
    parser.add_argument(
        "--author",
        action="append",
        default=[],
        metavar="NAME",
        help='of ro-crate: who publishes it, "NAME <ORCID>" or a name alone; may be given again (default: the '
        "session's operator)",
    )
    parser.add_argument(
        "--licence",
        default="",
        metavar="LICENCE",
        help="of ro-crate: an identifier of the SPDX list such as CC-BY-4.0, an address, or words (default: a note "
        "that none is stated)",
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
    _require_options_of_its_own(options)
    if options.format == _LEROBOT:
        return _export_lerobot(options)
    session, *others = options.sessions
    if others:
        raise RecordingError(
            f"{others[0]}: --format {options.format} takes one session; give one at a time, or --format {_LEROBOT}"
        )
    if options.format == _EXPERIMENT:
        return _export_experiment(session, options)
    if options.format == _RO_CRATE:
        return _export_ro_crate(session, options)
    return _export_ros2(session, options) if options.format == _ROS2 else _export_tables(session, options)


def _require_options_of_its_own(options: argparse.Namespace) -> None:
    """Refuse an option that the format does not have."""
    given = {
        "--fps": (_LEROBOT, options.fps is not None),
        "--video": (_LEROBOT, options.video),
        "--author": (_RO_CRATE, bool(options.author)),
        "--licence": (_RO_CRATE, bool(options.licence)),
    }
    for name, (owner, is_given) in given.items():
        if is_given and options.format != owner:
            raise RecordingError(f"{name} is of --format {owner}; leave it out for --format {options.format}")


def _export_experiment(session: Path, options: argparse.Namespace) -> Result:
    with progress() as tell:
        experiment, provenance = export_experiment(session, options.output, tell)
    noise = experiment.sensor
    beads = f"fiducials {noise.fiducial_std * 1e6:.1f} µm"
    if not experiment.fiducials.size:
        beads = "no fiducials: one camera measures no place in space, so that wrench and pose alone are there"
    return Result(
        f"{len(experiment.time)} rows in {options.output}; noise of one value: force {noise.force_std * 1e3:.2f} mN, "
        f"torque {noise.torque_std * 1e3:.3f} mN·m, {beads}",
        {"experiment": str(options.output), "rows": len(experiment.time), "provenance": asdict(provenance)},
    )


def _export_lerobot(options: argparse.Namespace) -> Result:
    if options.fps is not None and options.fps < 1:
        raise RecordingError(f"--fps {options.fps}: write a whole number of frames a second above zero")
    with progress() as tell:
        dataset = export_lerobot(options.sessions, options.output, options.fps, tell, as_video=options.video)
    lines = [f"{count:9d} frames  {session}" for session, count in dataset.frames.items()]
    if dataset.between:
        lines.append(
            f"{dataset.between} frames have no sample of the force sensor; read between their neighbours"
        )
    return Result(
        "\n".join([f"written to {options.output}; {dataset.fps} frames a second", *lines]),
        {"output": str(options.output), "format": options.format, **asdict(dataset)},
    )


def _export_ro_crate(session: Path, options: argparse.Namespace) -> Result:
    with progress() as tell:
        publication = Publication(tuple(options.author), options.licence)
        crate = export_ro_crate(session, options.output, publication, tell)
    lines = [f"written to {options.output}: {crate.files} files, {crate.entities} entities"]
    if crate.unsynchronised:
        lines.append(f"no experiment: {crate.unsynchronised}")
    if not options.licence:
        lines.append("no licence is stated; --licence CC-BY-4.0, for instance, states one")
    return Result(
        "\n".join(lines), {"output": str(options.output), "format": options.format, **asdict(crate)}
    )


def _export_tables(session: Path, options: argparse.Namespace) -> Result:
    with progress() as tell:
        exported = export_tables(session, options.format, options.output, tell)
    lines = [f"{rows:9d} rows  {name}" for name, rows in exported.rows.items()]
    if exported.unsynchronised:
        lines.append(f"no synchronised table: {exported.unsynchronised}")
    return Result(
        "\n".join([f"written to {options.output}", *lines]),
        {"output": str(options.output), "format": options.format, **asdict(exported)},
    )


def _export_ros2(session: Path, options: argparse.Namespace) -> Result:
    with progress() as tell:
        bag = export_ros2(session, options.output, tell)
    lines = [f"{count:9d} messages  {topic}" for topic, count in bag.messages.items()]
    if bag.unusable:
        lines.append(f"{bag.unusable} samples that the force sensor forbids to use are left out")
    return Result(
        "\n".join([f"written to {options.output}; stamps are wall-clock time", *lines]),
        {"output": str(options.output), "format": options.format, **asdict(bag)},
    )
