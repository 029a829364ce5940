"""``retract calibrate``: calibrate a part of the rig, tell the figures, and keep the outcome with its plot."""

import argparse
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import Any, Protocol

from daq.calibration.of_rig import require_kind
from daq.calibration.procedures import MOTIONS, evaluate, record_motion, serials_of
from daq.calibration.tool import ToolCalibration, flange_tool
from daq.calibration.view_names import TOLERANCE_S
from daq.calibration_files.in_force import why_unused
from daq.calibration_files.keeping import keep
from daq.calibration_files.outcome import KINDS, Outcome
from daq.cli.laboratory.board_views import from_live, from_stored
from daq.cli.rigs import VIRTUAL, add_rig
from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.devices import Devices, connected
from daq.errors import CalibrationError
from daq.recording.reader import open_recording
from daq.rig import Rig, make_devices, read_rig
from daq.virtual_rig.launch import virtual_rig
from daq.virtual_rig.standard import calibration_settings
from daq.vision.charuco import CharucoBoard

_EXAMPLES = """  retract calibrate stereo lab.toml --square 8.02 --marker 6.01
  retract calibrate cameras lab.toml --images views          stored views instead of live cameras
  retract calibrate stereo lab.toml --images views --sides 13021234 13021235
  retract calibrate camera lab.toml --images views           the only camera of a rig, for beads in two dimensions
  retract calibrate robot lab.toml                           moves the gripper, with a bead on it
  retract calibrate force lab.toml                           tilts the gripper in free air
  retract calibrate time lab.toml --motion tap
  retract calibrate tool lab.toml                            touch a fixed point in several orientations
  retract calibrate time lab.toml --session runs/sway        evaluate once more what was recorded
  retract calibrate force virtual --output runs/calibration"""


class Person(Protocol):
    """Who acts at the rig; each request is answered when it is done, with False when there is no more to do."""

    def show_board(self, number: int) -> bool:
        """Hold the board still for view ``number``."""

    def touch_point(self, number: int) -> bool:
        """Touch the fixed point with the gripper in orientation ``number``."""


class _PersonAtTerminal:
    def show_board(self, number: int) -> bool:
        where = "flat on the middle of the phantom" if number == 0 else "elsewhere, tilted"
        return self._ask(f"hold the board {where} and still")

    def touch_point(self, number: int) -> bool:
        return self._ask(f"touch the point with the gripper, in another orientation ({number} done)")

    def _ask(self, request: str) -> bool:
        sys.stderr.write(f"{request}; Enter takes it, q ends: ")
        sys.stderr.flush()
        answer = sys.stdin.readline()
        return bool(answer) and answer.strip().lower() != "q"


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "calibrate", "calibrate a part of the rig", _EXAMPLES, run)
    parser.add_argument("kind", choices=KINDS, help="what to calibrate")
    add_rig(parser)
    parser.add_argument(
        "--output",
        type=Path,
        metavar="DIR",
        help="where to keep it (default: the rig file's calibration folder)",
    )
    motions = sorted({motion for choices in MOTIONS.values() for motion in choices})
    parser.add_argument("--motion", choices=motions, help="of the robot (default: the usual one of its kind)")
    parser.add_argument(
        "--session", type=Path, metavar="DIR", help="evaluate this recorded motion; moves nothing"
    )
    parser.add_argument(
        "--images",
        type=Path,
        metavar="DIR",
        help="views of the board as PNG, here or in folders below; an image of the left and one of the right camera "
        "are of one moment where their names have the same number (left_0003.png and right_0003.png) or times that "
        "nearly agree; L and R, cam0 and cam1, folders left and right tell the camera too",
    )
    parser.add_argument(
        "--sides",
        nargs=2,
        metavar=("LEFT", "RIGHT"),
        help="what the names of the images of the left and of the right camera hold, such as serial numbers",
    )
    parser.add_argument(
        "--tolerance",
        type=float,
        default=TOLERANCE_S * 1e3,
        metavar="MS",
        help="largest difference of the times in the names of a pair (default: %(default)g)",
    )
    board = CharucoBoard()
    parser.add_argument("--columns", type=int, default=board.columns, help="squares (default: %(default)s)")
    parser.add_argument("--rows", type=int, default=board.rows, help="squares (default: %(default)s)")
    for name, value in (("square", board.square_m), ("marker", board.marker_m)):
        parser.add_argument(
            f"--{name}",
            type=float,
            default=value * 1e3,
            metavar="MM",
            help="edge as measured on the print (default: %(default)s)",
        )
    parser.add_argument(
        "--dictionary", default=board.dictionary, help="of the markers (default: %(default)s)"
    )
    parser.add_argument(
        "--legacy-pattern",
        action="store_true",
        help="printed by OpenCV before 4.6; found out by itself where the first view shows it",
    )


def run(options: argparse.Namespace) -> Result:
    """Calibrate, keep, and tell; the exit status is 1 for a rejected calibration."""
    with _opened(options) as (rig, person):
        require_kind(options.kind, rig)
        folder = options.output or rig.calibration
        if folder is None:
            raise CalibrationError(
                'calibrate: the rig file names no folder of calibrations; write calibration = "calibration" into it, '
                "or give --output"
            )
        outcome, serials = _outcome(options, rig, person, folder)
        path = keep(outcome, folder, rig.name, serials, accepted=outcome.acceptable)
    verdict = "accepted" if outcome.acceptable else "rejected"
    unused = why_unused(options.kind, rig)
    kept = f"{verdict}, kept in {path} with its plot"
    return Result(
        "\n".join([outcome.describe(), kept, *([f"not in force: {unused}"] if unused else [])]),
        {
            "kind": options.kind,
            "verdict": verdict,
            "file": str(path),
            "figures": [{**asdict(figure), "passed": figure.passed} for figure in outcome.figures],
        },
        status=0 if outcome.acceptable else 1,
    )


@contextmanager
def _opened(options: argparse.Namespace) -> Iterator[tuple[Rig, Person]]:
    if options.rig != VIRTUAL:
        yield read_rig(Path(options.rig)), _PersonAtTerminal()
        return
    with (
        tempfile.TemporaryDirectory(prefix="virtual-rig-") as folder,
        virtual_rig(Path(folder), calibration_settings(options.kind)) as running,
    ):
        yield read_rig(running.rig_path), running.operator


def _outcome(
    options: argparse.Namespace, rig: Rig, person: Person, folder: Path
) -> tuple[Outcome[Any], dict[str, str]]:
    """Return the outcome, and the serial numbers of the devices that it is of."""
    if options.session is not None:
        recording = open_recording(options.session)
        known = {role: identity.serial for role, identity in recording.info.devices.items()}
        with progress() as tell:
            return evaluate(options.kind, recording, tell), serials_of(options.kind, known)
    if options.images is not None:
        return from_stored(options, rig), {}
    with connected(make_devices(rig)) as devices:
        serials = {role: device.identity.serial for role, device in devices.all().items()}
        if options.kind in MOTIONS:
            motion = options.motion or MOTIONS[options.kind][0]
            session = folder / "sessions" / f"{motion}_{datetime.now().astimezone():%Y-%m-%d_%H%M%S}"
            with progress() as tell:
                recording = record_motion(options.kind, motion, rig, devices, session, tell)
                outcome = evaluate(options.kind, recording, tell)
        elif options.kind == "tool":
            outcome = _by_touch(rig, devices, person)
        else:
            outcome = from_live(options, rig, devices, person.show_board)
        return outcome, serials_of(options.kind, serials)


def _by_touch(rig: Rig, devices: Devices, person: Person) -> Outcome[Any]:
    collected = ToolCalibration(flange_tool(rig))
    while person.touch_point(collected.figures.touches):
        told = collected.add(devices.robot.state().T_base_tool)
        sys.stderr.write(
            f"touch {told.touches}: turned by {told.turn_deg:.0f}°, off one point by {told.rms_m * 1e3:.3f} mm rms\n"
        )
    return collected.finish()
