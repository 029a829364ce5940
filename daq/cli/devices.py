"""``retract devices``: connect to every device of a rig and tell who answers. Nothing moves.

The exit status is 2 where one does not.
"""

import argparse
from dataclasses import asdict

from daq.cli.rigs import add_rig, opened_rig
from daq.cli.verb import Result, Verbs, add_verb
from daq.rig import make_devices
from robot_drivers.errors import DeviceError
from robot_drivers.protocols import Camera, ForceSensor, Robot

_EXAMPLES = """  retract devices lab.toml
  retract devices virtual --json"""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    add_rig(add_verb(verbs, "devices", "tell which devices of a rig answer", _EXAMPLES, run))


def run(options: argparse.Namespace) -> Result:
    """Try every device by itself, so that one that is missing hides no other."""
    with opened_rig(options.rig) as rig:
        found = {role: _look(device) for role, device in make_devices(rig).all().items()}
    width = max(map(len, found))
    lines = []
    for role, told in found.items():
        lines.append(f"{role:{width}}  {told['error'] or _describe(told)}")
    missing = any(told["error"] for told in found.values())
    return Result("\n".join(lines), {"devices": found}, status=2 if missing else 0)


def _look(device: ForceSensor | Robot | Camera) -> dict[str, object]:
    try:
        device.connect()
        return {"error": None, **asdict(device.identity)}
    except DeviceError as error:
        return {"error": str(error)}
    finally:
        device.close()


def _describe(told: dict[str, object]) -> str:
    details = told["details"]
    extra = [f"{key} {value}" for key, value in details.items()] if isinstance(details, dict) else []
    return ", ".join([f"{told['model']}", f"serial {told['serial']}", f"at {told['address']}", *extra])
