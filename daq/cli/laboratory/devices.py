"""``retract devices``: find and check every device of a rig. Nothing moves.

The exit status is 1 where a check fails, and 2 for a rig file that cannot be right.
"""

import argparse
from dataclasses import asdict, fields

from daq.cli.rigs import VIRTUAL, opened_rig
from daq.cli.verb import Result, Verbs, add_verb
from daq.device_checks import DeviceReport, check_devices
from daq.devices import ROLES, installed_drivers
from daq.errors import RigError
from daq.rig import make_devices
from robot_drivers.driver import Driver

_EXAMPLES = """  retract devices lab.toml
  retract devices lab.toml --seconds 10
  retract devices virtual --json
  retract devices --list                     the drivers that a rig file may name, those of other packages too"""
_SECONDS = 2.0


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "devices", "find and check the devices of a rig", _EXAMPLES, run)
    parser.add_argument(
        "rig", metavar="RIG", nargs="?", help=f'rig file, or "{VIRTUAL}" for an emulated laboratory'
    )
    parser.add_argument(
        "--list",
        action="store_true",
        help="print the drivers that a rig file may name, with their settings and the package that each is of",
    )
    parser.add_argument(
        "--seconds",
        type=float,
        default=_SECONDS,
        metavar="S",
        help="how long to look at what each device delivers (default: %(default)s)",
    )


def run(options: argparse.Namespace) -> Result:
    """Check, and tell one row a device, with what failed first; or tell which drivers there are."""
    if options.list:
        return _drivers()
    if options.rig is None:
        raise RigError(f"name a rig file, or {VIRTUAL}; --list tells the drivers that it may name")
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


def _drivers() -> Result:
    lines, data = [], {}
    for role in ROLES:
        found = installed_drivers(role)
        lines.append(f"{role.words}:")
        width = max(len(one.name) for one in found)
        for one in found:
            of_package = f"  [{one.package}]" if one.package else ""
            lines.append(f"  {one.name:{width}}  {', '.join(_settings(one.driver))}{of_package}")
        data[role.words] = {
            one.name: {"package": one.package or None, "settings": _settings(one.driver)} for one in found
        }
    return Result("\n".join(lines), {"drivers": data})


def _settings(driver: Driver) -> list[str]:
    """Return the keys of a driver's settings in a rig file."""
    return [field.name for field in fields(driver.settings) if field.init]
