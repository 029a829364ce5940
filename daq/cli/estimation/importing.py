"""``retract import``: make an experiment folder of measurements that were taken elsewhere."""

import argparse
from pathlib import Path

from daq.bags.bag import is_bag
from daq.bags.reading import read_bag
from daq.cli.verb import Result, Verbs, add_verb
from estimator.experiment_checks.checking import Checked
from estimator.experiment_checks.telling import as_data, as_text
from estimator.importing import Imported, import_experiment
from estimator.importing.importing import told

_EXAMPLES = """  retract import trial.csv --output experiments/trial
  retract import capture.c3d --output experiments/trial --mapping lab.import.toml
  retract import dic_frames/ --output experiments/sheet
  retract import rosbag2_2026_05_04/ --output experiments/pull

The first call writes experiments/trial.import.toml with all that could be understood, and says which lines are to be
filled in (exit status 2). The same call again then writes the experiment, a picture of it beside it, and what
`retract check` says of it (exit status 2 where something is wrong)."""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "import", "make an experiment of measurements from elsewhere", _EXAMPLES, run)
    parser.add_argument(
        "source",
        type=Path,
        metavar="SOURCE",
        help="CSV, XLSX, NPZ, HDF5, MAT, C3D, a rosbag2 folder, MCAP, or a folder of files, such as the frames of an "
        "image correlation",
    )
    parser.add_argument(
        "--output", type=Path, required=True, metavar="DIR", help="experiment folder to write; a new one"
    )
    parser.add_argument(
        "--mapping",
        type=Path,
        metavar="FILE",
        help="what the columns are (default: DIR.import.toml, which is proposed if it is not there)",
    )


def run(options: argparse.Namespace) -> Result:
    """Import, and tell what is still open or what came out."""
    source = read_bag(options.source) if is_bag(options.source) else options.source
    done = import_experiment(source, options.output, options.mapping)
    if done.open_lines:
        return _open(done)
    checked = Checked(options.output, done.findings, done.experiment)
    wrong = checked.wrong or done.experiment is None
    data = {
        "mapping": str(done.mapping),
        "experiment": None if done.experiment is None else str(options.output),
        "picture": str(done.picture),
        "refusal": done.refusal,
        "check": as_data([checked]),
        "remarks": list(done.remarks),
    }
    if done.experiment is None:
        head = f"not written: {done.refusal}; correct {done.mapping}"
    else:
        head = f"{len(done.experiment.time)} rows, {len(done.experiment.fiducials_rest)} beads in {options.output}"
    lines = [head, f"picture {done.picture}", f"mapping {done.mapping}", *done.remarks, as_text([checked])]
    return Result("\n".join(line for line in lines if line), data, status=2 if wrong else 0)


def _open(done: Imported) -> Result:
    what = "written; fill in" if done.proposed else "fill in"
    text = f"{done.mapping}: {what} {told(done.open_lines)}; then run the command again"
    if done.picture is not None:
        text += f"\npicture {done.picture}"
    lines = [{"line": number, "key": key} for number, key in done.open_lines]
    data = {"mapping": str(done.mapping), "experiment": None, "open": lines, "remarks": list(done.remarks)}
    return Result("\n".join([text, *done.remarks]), data, status=2)
