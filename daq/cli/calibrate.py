"""``retract calibrate``: calibrate a part of the rig, tell the figures, and keep the outcome with its plot."""

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from daq.acquisition.stereo_look import StereoLook
from daq.calibration.cameras import BoardCalibration, grey, lying_on_phantom
from daq.calibration.keeping import keep
from daq.calibration.outcome import KINDS, Outcome
from daq.calibration.procedures import MOTIONS, evaluate, record_motion, serials_of
from daq.calibration.stored_views import StoredViews, find_views
from daq.calibration.tool import ToolCalibration, flange_tool
from daq.calibration.view_names import TOLERANCE_S
from daq.cli.rigs import VIRTUAL, add_rig
from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.devices import Devices
from daq.errors import CalibrationError
from daq.recording.reader import open_recording
from daq.rig import Rig, make_devices, read_rig
from daq.session.session import connected
from daq.virtual_rig.launch import virtual_rig
from daq.virtual_rig.standard import calibration_settings
from daq.vision.charuco import CharucoBoard

_EXAMPLES = """  retract calibrate stereo lab.toml --square 8.02 --marker 6.01
  retract calibrate cameras lab.toml --images views          stored views instead of live cameras
  retract calibrate stereo lab.toml --images views --sides 13021234 13021235
  retract calibrate robot lab.toml                           moves the gripper, with a bead on it
  retract calibrate force lab.toml                           tilts the gripper in free air
  retract calibrate time lab.toml --motion tap
  retract calibrate tool lab.toml                            touch a fixed point in several orientations
  retract calibrate time lab.toml --session runs/sway        evaluate once more what was recorded
  retract calibrate force virtual --output runs/calibration"""

_PASSED_OVER = 2  # images of each camera
_MOST_TRIES = 5  # of the first view
_LOOK_TIMEOUT_S = 15.0
_FRAME_TIMEOUT_S = 5.0


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
        folder = options.output or rig.calibration
        if folder is None:
            raise CalibrationError(
                'calibrate: the rig file names no folder of calibrations; write calibration = "calibration" into it, '
                "or give --output"
            )
        outcome, serials = _outcome(options, rig, person, folder)
        path = keep(outcome, folder, rig.name, serials, accepted=outcome.acceptable)
    verdict = "accepted" if outcome.acceptable else "rejected"
    return Result(
        f"{outcome.describe()}\n{verdict}, kept in {path} with its plot",
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
        return _from_stored(options, rig), {}
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
            outcome = _from_live(options, rig, devices, person)
        return outcome, serials_of(options.kind, serials)


def _by_touch(rig: Rig, devices: Devices, person: Person) -> Outcome[Any]:
    collected = ToolCalibration(flange_tool(rig))
    while person.touch_point(collected.figures.touches):
        told = collected.add(devices.robot.state().T_base_tool)
        sys.stderr.write(
            f"touch {told.touches}: turned by {told.turn_deg:.0f}°, off one point by {told.rms_m * 1e3:.3f} mm rms\n"
        )
    return collected.finish()


def _from_stored(options: argparse.Namespace, rig: Rig) -> Outcome[Any]:
    """Calibrate from stored views; in the first of them the board lies on the phantom."""
    collected, board = _collection(options)
    marks = None if options.sides is None else (options.sides[0], options.sides[1])
    stored = find_views(options.images, marks, _tolerance_s(options))
    _tell(stored.describe())
    missing = _missing_first(stored)
    for number, view in enumerate(stored.read()):
        told = collected.add(view.left, view.right, view.name)
        _tell(f"{view.name}: {told.describe()}")
        if number == 0 and told.problem:
            missing = f"{view.name} was not taken"
    if missing and options.kind == "stereo":
        _tell(
            f"{missing}: in the first view the board lies on the phantom, which tells where the tissue frame is"
        )
    return _finished(options, rig, collected, board, first_is_there=not missing)


def _missing_first(stored: StoredViews) -> str:
    return "" if stored.names.first_paired else "the first image of all has no partner"


def _tolerance_s(options: argparse.Namespace) -> float:
    if not options.tolerance >= 0.0:
        raise CalibrationError(f"--tolerance {options.tolerance:g}: is a time in ms, 0 or more")
    return float(options.tolerance) * 1e-3


def _from_live(options: argparse.Namespace, rig: Rig, devices: Devices, person: Person) -> Outcome[Any]:
    collected, board = _collection(options)
    number = tries = 0
    while person.show_board(number):
        told = collected.add(*_look(devices))
        _tell(told.describe())
        tries += 1
        # until it is taken, the first view is asked for again: only it shows the board at its known place
        number += told.views > 0
        if not told.views and tries == _MOST_TRIES:
            raise CalibrationError(
                f"{options.kind}: the board was not found in {tries} views ({told.problem})"
            )
    return _finished(options, rig, collected, board)


def _collection(options: argparse.Namespace) -> tuple[BoardCalibration, CharucoBoard]:
    if options.kind not in ("cameras", "stereo"):
        raise CalibrationError(f"{options.kind}: is not made from images of a board")
    try:
        board = CharucoBoard(
            options.columns,
            options.rows,
            options.square * 1e-3,
            options.marker * 1e-3,
            options.dictionary,
            options.legacy_pattern,
        )
    except ValueError as error:
        raise CalibrationError(f"calibrate: {error}") from error
    return BoardCalibration(board), board


def _finished(
    options: argparse.Namespace,
    rig: Rig,
    collected: BoardCalibration,
    board: CharucoBoard,
    *,
    first_is_there: bool = True,
) -> Outcome[Any]:
    with progress() as tell:
        if options.kind == "cameras":
            return collected.finish_cameras(tell)
        return collected.finish_stereo(lying_on_phantom(board, rig), tell, first_is_there=first_is_there)


def _tell(words: str) -> None:
    sys.stderr.write(f"{words}\n")
    sys.stderr.flush()


def _look(devices: Devices) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return an image of each camera, exposed together after the call."""
    look = StereoLook()
    for camera in devices.cameras.values():
        while camera.read(0.0):
            pass
    look.ask()
    deadline = time.monotonic() + _LOOK_TIMEOUT_S
    seen = dict.fromkeys(devices.cameras, 0)
    while time.monotonic() < deadline:
        for name, camera in devices.cameras.items():
            frames = camera.read(_FRAME_TIMEOUT_S)
            if not frames:
                raise CalibrationError(
                    f"camera {name}: no image in {_FRAME_TIMEOUT_S:g} s; check the camera and its light"
                )
            # what lay on its way when the board was shown is passed over
            fresh = frames[max(0, _PASSED_OVER - seen[name]) :]
            seen[name] += len(frames)
            look.add(name, fresh)
        if found := look.take(tuple(devices.cameras)):
            left, right = (grey(frame.image, frame.pixel_format) for frame in found.values())
            return left, right
    raise CalibrationError(
        f"cameras: no two images of one moment in {_LOOK_TIMEOUT_S:g} s; start both at one frame rate, or "
        "synchronise them"
    )
