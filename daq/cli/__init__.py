"""The command line ``retract``: one module for each verb, each a thin layer over functions that a script can call."""

import argparse
import sys
from collections.abc import Sequence
from importlib import import_module

from daq.cli.ending import interrupted_by_signals
from daq.cli.verb import concluded, fail
from estimator.errors import EstimatorError

# every verb, and the package of its family
_VERBS = {
    "demo": "laboratory",
    "gui": "laboratory",
    "devices": "laboratory",
    "emulate": "laboratory",
    "calibrate": "laboratory",
    "record": "sessions",
    "investigate": "sessions",
    "recover": "sessions",
    "replay": "sessions",
    "export": "sessions",
    "import": "estimation",
    "check": "estimation",
    "simulate": "estimation",
    "estimate": "estimation",
    "budget": "estimation",
    "diagnose": "diagnosis",
    "handover": "estimation",
    "uniaxial": "estimation",
    "phantom": "bodies",
    "mesh": "bodies",
    "study": "estimation",
    "benchmark": "estimation",
    "faults": "laboratory",
}

# what no module can be called
_MODULES = {"import": "importing"}

_EXAMPLES = """examples:
  retract demo                               the whole chain on a virtual laboratory, a minute and a half
  retract gui --virtual                      the operator's window over a virtual laboratory
  retract devices lab.toml                   who answers, and how
  retract emulate netft --port 49152         one emulated device, to try things on
  retract record lab.toml --trajectory pull  record one retraction
  retract export sessions/2026-05-04_143210_P07_pull --output experiments/pull
  retract estimate experiments/pull --json
  retract diagnose cases/P07 --output runs/P07

Wherever a rig file is expected, the word "virtual" stands for an emulated laboratory on this computer.
Exit status: 0 done, 1 a check of a device failed, 2 wrong input or a failed device (one line on standard error),
130 interrupted, 143 ended by SIGTERM or a closed terminal: either way the robot is held, what is recorded is sealed,
and every process that the command has started ends with it."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one verb and return the exit status."""
    arguments = sys.argv[1:] if arguments is None else arguments
    parser = argparse.ArgumentParser(
        prog="retract",
        description="Soft-tissue retraction: record, synchronise, estimate.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    verbs = parser.add_subparsers(metavar="VERB", required=True)
    try:
        for verb in _wanted(arguments):
            import_module(f"daq.cli.{_VERBS[verb]}.{_MODULES.get(verb, verb)}").add_parser(verbs)
        options = parser.parse_args(arguments)
    except EstimatorError as error:
        # another package adds effects or laws that cannot be
        return fail(str(error), status=2)
    with interrupted_by_signals():
        return concluded(lambda: options.run(options), as_json=options.json)


def _wanted(arguments: Sequence[str]) -> Sequence[str]:
    """Return the verb that is called, else all: to import all takes seconds, for which no device should wait."""
    return arguments[:1] if arguments and arguments[0] in _VERBS else tuple(_VERBS)
