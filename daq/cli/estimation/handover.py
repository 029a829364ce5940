"""``retract handover``: what was found of a phantom, for another simulator."""

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import Any

from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.progress import Progress
from estimator.diagnosis.conclusions.as_json import as_json
from estimator.diagnosis.diagnose import diagnose
from estimator.effects.catalogue import Catalogue, default_catalogue
from estimator.errors import InputError
from estimator.experiment import Experiment, check_same_mounting, read_case
from estimator.fit.estimate import estimate
from estimator.handover.comparison import table
from estimator.handover.found import Found
from estimator.handover.handing_over import ENGINES, PAGE_FILE, Wanted, write_handover
from estimator.handover.reading import found_of, read_found
from estimator.handover.written import Written

_EXAMPLES = """  retract handover cases/P07 --to calculix --output runs/P07_calculix
  retract handover cases/P07 --to calculix --result runs/P07/diagnosis.json --verify --output runs/P07_calculix
  retract handover experiments/pull --to mujoco --run estimate --draws 1000 --output runs/pull_mujoco

The folder holds the engine's own files, sensors.py with sensors.json (what sensors and cameras make of any simulator's
observations; numpy alone), draws.csv and draws.json for domain randomisation, and a page README.md. What the engine
cannot express is left out, by its name."""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    summary = "hand the calibrated phantom and the causes over to another simulator"
    parser = add_verb(verbs, "handover", summary, _EXAMPLES, run)
    parser.add_argument("--to", choices=sorted(ENGINES), required=True, help="the simulator")
    parser.add_argument(
        "--output", type=Path, metavar="DIR", required=True, help="folder of the handover; must not exist"
    )
    parser.add_argument(
        "--result",
        type=Path,
        metavar="FILE",
        help="what was found: JSON of retract estimate --json or retract diagnose --output (default: found anew)",
    )
    parser.add_argument(
        "--run",
        choices=("diagnosis", "estimate"),
        default="diagnosis",
        dest="anew",
        help="what is run where no result is given (default: %(default)s)",
    )
    parser.add_argument(
        "--draws", type=int, default=200, metavar="N", help="for domain randomisation (default: %(default)s)"
    )
    parser.add_argument("--seed", type=int, default=1, help="of the draws (default: %(default)s)")
    parser.add_argument(
        "--verify",
        action="store_true",
        help="run the simulator where it is installed, and compare with our model",
    )
    parser.add_argument(
        "case", type=Path, metavar="CASE", help="folder of experiments of one phantom, or one experiment"
    )


def run(options: argparse.Namespace) -> Result:
    """Hand over, and tell what was written."""
    experiments = read_case(options.case)
    check_same_mounting(experiments)
    if len({one.name for one in experiments}) < len(experiments):
        raise InputError(
            f"{options.case}: two experiments have one name; give each its own in experiment.toml"
        )
    wanted = Wanted(options.to, options.draws, options.seed, options.verify)
    with progress() as tell:
        catalogue = default_catalogue().looked_for_in(experiments)
        if options.result:
            found = read_found(options.result, catalogue)
        else:
            found = _anew(options.anew, experiments, catalogue, tell)
        written = write_handover(found, experiments, wanted, options.output, tell)
    return Result(_text(written), _data(written))


def _anew(what: str, experiments: list[Experiment], catalogue: Catalogue, tell: Progress) -> Found:
    if what == "estimate":
        return found_of(estimate(experiments, tell).as_json())
    return found_of(as_json(diagnose(experiments, tell)), catalogue)


def _text(written: Written) -> str:
    handed = written.handed
    lines = [
        f"{len(written.files)} files in {written.folder}; begin with {PAGE_FILE}",
        f"causes in: {', '.join(handed.causes) or 'none'}",
        *(f"left out: {name}: {why}" for name, why in handed.left_out.items()),
        *(f"note: {note}" for note in written.notes),
    ]
    if written.compared:
        lines += [f"{written.version} beside our own model:", table(written.compared)]
    else:
        lines.append(f"not run: {written.not_run}")
    return "\n".join(lines)


def _data(written: Written) -> dict[str, Any]:
    return {
        "folder": str(written.folder),
        "files": list(written.files),
        "causes": list(written.handed.causes),
        "left_out": dict(written.handed.left_out),
        "notes": list(written.notes),
        "engine": written.version,
        "compared": [asdict(one) for one in written.compared],
        "not_run": written.not_run,
    }
