"""``retract devices``: find and check every device of a rig. Nothing moves.

The exit status is 1 where a check fails, and 2 for a rig file that cannot be right.
"""

import argparse
from dataclasses import asdict

from daq.cli.rigs import add_rig, opened_rig
from daq.cli.verb import Result, Verbs, add_verb
from daq.device_checks import DeviceReport, check_devices
from daq.errors import RigError
from daq.rig import make_devices

_EXAMPLES = """  retract devices lab.toml
  retract devices lab.toml --seconds 10
  retract devices virtual --json"""
_SECONDS = 2.0


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "devices", "find and check the devices of a rig", _EXAMPLES, run)
    add_rig(parser)
    parser.add_argument(
        "--seconds",
        type=float,
        default=_SECONDS,
        metavar="S",
        help="how long to look at what each device delivers (default: %(default)s)",
    )


def run(options: argparse.Namespace) -> Result:
    """Check, and tell one row a device, with what failed first."""
    if not options.seconds > 0:
        raise RigError(f"--seconds {options.seconds:g}: must be positive")
    with opened_rig(options.rig) as rig:
        reports = check_devices(rig, make_devices(rig), options.seconds)
    width = max(len(report.role) for report in reports)
    lines = [
        f"{report.role:{width}}  {'ok    ' if report.passed else 'FAILED'}  {_row(report)}"
        for report in reports
    ]
    data = {report.role: {"passed": report.passed, **asdict(report)} for report in reports}
    return Result("\n".join(lines), {"devices": data}, status=0 if all(r.passed for r in reports) else 1)


def _row(report: DeviceReport) -> str:
    failed_first = sorted(report.checks, key=lambda check: check.passed)
    return "; ".join(f"{check.name}{'' if check.passed else ' (!)'}: {check.told}" for check in failed_first)
