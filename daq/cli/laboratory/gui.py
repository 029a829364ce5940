"""``retract gui``: the operator's window, as a program of its own that this one waits for."""

import argparse
import os
import subprocess
import sys

from daq.cli.ending import Terminated
from daq.cli.verb import Result, Verbs, add_verb
from daq.lifeline import with_lifeline

_EXAMPLES = """  retract gui --virtual            everything can be tried without hardware
  retract gui lab.toml             the rig of a rig file; each device can be emulated by itself
  retract gui lab.toml --sessions day1"""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "gui", "open the operator's window", _EXAMPLES, run)
    parser.add_argument("rig", metavar="RIG", nargs="?", help="rig file (default: asks)")
    parser.add_argument("--virtual", action="store_true", help="every device emulated")
    parser.add_argument(
        "--sessions", metavar="DIR", default="sessions", help="of the recordings (default: %(default)s)"
    )
    parser.add_argument("--theme", choices=("light", "dark"), help="(default: as the desktop)")


def run(options: argparse.Namespace) -> Result:
    """Show the window and wait until it is closed; its process hears the keyboard's interrupt as well.

    Where this program ends first, by a signal or without a word, the window holds the robot, seals, and closes.
    """
    command = with_lifeline("gui", "--sessions", options.sessions)
    command += [options.rig] if options.rig else []
    command += ["--virtual"] if options.virtual else []
    command += ["--theme", options.theme] if options.theme else []
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    with subprocess.Popen(command, env=environment, stdin=subprocess.PIPE) as window:
        while True:
            try:
                status = window.wait()
                break
            except Terminated:
                raise
            except KeyboardInterrupt:
                continue  # the window asks what is to be done
    words = "the window is closed" if status == 0 else "the window has ended early; its own line tells why"
    return Result(words, {"status": status}, status)
