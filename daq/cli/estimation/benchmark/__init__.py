"""``retract benchmark``: a blind test of the diagnosis, which anyone's answers may enter."""

from daq.cli.estimation.benchmark.entries import add_enter, add_leaderboard
from daq.cli.estimation.benchmark.making import add_make
from daq.cli.estimation.benchmark.scoring import add_run, add_score
from daq.cli.estimation.benchmark.sealing import add_commit, add_reveal
from daq.cli.verb import Verbs


def add_parser(verbs: Verbs) -> None:
    """Add the verb with its actions."""
    summary = "a blind test of the diagnosis, on cases of another simulator, and of anyone's answers"
    parser = verbs.add_parser("benchmark", help=summary, description=f"{summary.capitalize()}.")
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    for add in (add_make, add_commit, add_run, add_enter, add_score, add_leaderboard, add_reveal):
        add(actions)
