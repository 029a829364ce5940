"""``retract recover``: seal a session that was cut off."""

import argparse
from pathlib import Path

from daq.cli.verb import Result, Verbs, add_verb
from daq.recording.folder import recover_session

_EXAMPLES = """  retract recover sessions/2026-05-04_143210_P07_pull"""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "recover", "save what a session holds that was cut off", _EXAMPLES, run)
    parser.add_argument("session", type=Path, metavar="SESSION", help="session folder")


def run(options: argparse.Namespace) -> Result:
    """Recover, and tell what was kept."""
    info, dropped_bytes = recover_session(options.session)
    kept = "\n".join(f"  {count:8d}  {topic}" for topic, count in info.samples.items())
    return Result(
        f"recovered {options.session}; {dropped_bytes} bytes of incomplete messages left out\n{kept}",
        {"session": str(options.session), "samples": info.samples, "dropped_bytes": dropped_bytes},
    )
