"""``python -m daq.acquisition``: what a client starts. Standard input and output belong to the messages."""

import os
import sys

from daq.acquisition.process import serve
from daq.lifeline import leave_signals_to_parent
from robot_drivers.real_time import prefer_this_process, shorten_turns


def main() -> None:
    """Serve the client at the other end of standard input and output."""
    # whatever else prints must not get between the messages
    reports = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    leave_signals_to_parent()  # the client will say what is to be done
    prefer_this_process()
    shorten_turns()
    serve(sys.stdin.buffer, reports)


if __name__ == "__main__":
    main()
