"""``retract emulate``: one emulated device as a process of its own, until Ctrl-C."""

import argparse
import json
import sys
import time

from daq.cli.verb import Result, Verbs, add_verb, write
from robot_drivers.emulators import KINDS, EmulatorKind
from robot_drivers.emulators.options import add_options, read_options

_EXAMPLES = "\n".join(f"  retract emulate {name} {kind.example}" for name, kind in KINDS.items()) + (
    "\n\nretract emulate KIND --help tells the options and faults of a kind."
)
_LOOK_S = 0.2


def add_parser(verbs: Verbs) -> None:
    """Add the verb, with a verb of its own for every kind of emulator."""
    parser = add_verb(verbs, "emulate", "run one emulated device until Ctrl-C", _EXAMPLES, run)
    kinds = parser.add_subparsers(metavar="KIND", required=True)
    for name, kind in KINDS.items():
        of_kind = kinds.add_parser(
            name,
            help=kind.summary,
            description=f"Emulate: {kind.summary}. It listens on this computer only unless told otherwise.",
            epilog=f"example:\n  retract emulate {name} {kind.example}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        for title, settings in kind.options.items():
            add_options(of_kind, title, settings, kind.flags)
        of_kind.set_defaults(kind=kind)


def run(options: argparse.Namespace) -> Result:
    """Run until interrupted; one line on standard output says where it listens, standard error what happens to it."""
    kind: EmulatorKind = options.kind
    parts = [read_options(options, settings) for settings in kind.options.values()]
    with kind.start(*parts) as running:
        write(
            json.dumps({"listening": running.where}) if options.json else f"{running.where}; Ctrl-C ends it"
        )
        told = ""
        while True:
            time.sleep(_LOOK_S)
            if (report := running.report()) != told:
                told = report
                sys.stderr.write(f"{report}\n")
