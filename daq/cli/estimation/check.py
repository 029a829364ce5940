"""``retract check``: tell what is wrong or suspicious in experiment folders, before anything is solved."""

import argparse
from pathlib import Path

from daq.cli.verb import Result, Verbs, add_verb
from estimator.experiment_checks import check_folder
from estimator.experiment_checks.telling import as_data, as_text

_EXAMPLES = """  retract check experiments/pull
  retract check cases/P07 --json

One line for each finding: its grade, file, line and column, what was found, and what to do. Exit status 0 where nothing
is wrong, 2 where something is; what is suspicious can be as it stands, and seldom is."""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "check", "tell what is wrong or suspicious in an experiment", _EXAMPLES, run)
    parser.add_argument(
        "folders",
        type=Path,
        nargs="+",
        metavar="DIR",
        help="experiment folder, or a folder of all experiments of one phantom",
    )


def run(options: argparse.Namespace) -> Result:
    """Check, and tell."""
    checked = [one for folder in options.folders for one in check_folder(folder)]
    return Result(as_text(checked), as_data(checked), status=2 if any(one.wrong for one in checked) else 0)
