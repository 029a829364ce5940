"""``retract recover``: save what a session holds that was cut off or damaged."""

import argparse
from dataclasses import asdict
from pathlib import Path

from daq.cli.verb import Result, Verbs, add_verb
from daq.recording.recovery import Recovery, recover_session

_EXAMPLES = """  retract recover sessions/2026-05-04_143210_P07_pull"""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(
        verbs, "recover", "save what a session holds that was cut off or damaged", _EXAMPLES, run
    )
    parser.add_argument("session", type=Path, metavar="SESSION", help="session folder")


def run(options: argparse.Namespace) -> Result:
    """Recover, and tell what was kept, what could not be used, and what each stream has lost."""
    recovery = recover_session(options.session)
    damages = {name: [asdict(damage) for damage in report.damages] for name, report in recovery.files.items()}
    return Result(
        _text(options.session, recovery),
        {
            "session": str(options.session),
            "samples": recovery.info.samples,
            "dropped_bytes": recovery.left_out_bytes,
            "damages": damages,
            "lost": {stream: asdict(loss) for stream, loss in recovery.lost.items()},
            "unchecked": sum(report.unchecked for report in recovery.files.values()),
            "problems": recovery.info.problems,
        },
    )


def _text(session: Path, recovery: Recovery) -> str:
    lines = [f"recovered {session}; {recovery.left_out_bytes} bytes could not be used"]
    lines += [f"  {count:8d}  {topic}" for topic, count in recovery.info.samples.items()]
    for name, report in recovery.files.items():
        lines += [
            f"{name}, bytes {damage.start} to {damage.end} ({damage.size}): {damage.what}"
            for damage in report.damages
        ]
        lines += [f"{name}: {note}" for note in report.notes]
        if report.unchecked:
            lines.append(f"{name}: {report.unchecked} messages have no checksum and were not checked")
    lost = {stream: loss for stream, loss in recovery.lost.items() if loss.samples}
    lines += [f"{loss!s:>10}  samples of {stream} lost" for stream, loss in lost.items()]
    return "\n".join(lines)
