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

import cv2
import numpy as np
from numpy.typing import NDArray

from daq.calibration.cameras import BoardCalibration, grey, lying_on_phantom
from daq.calibration.keeping import keep
from daq.calibration.outcome import KINDS, Outcome
from daq.calibration.procedures import MOTIONS, evaluate, record_motion, serials_of
from daq.calibration.tool import ToolCalibration, flange_tool
from daq.cli.rigs import VIRTUAL, add_rig
from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.devices import Devices
from daq.errors import CalibrationError
from daq.png import is_whole_png
from daq.recording.reader import open_recording
from daq.rig import Rig, make_devices, read_rig
from daq.session.session import connected
from daq.virtual_rig.launch import virtual_rig
from daq.virtual_rig.standard import calibration_settings
from daq.vision.charuco import CharucoBoard
from estimator.input_file import read_input
from robot_drivers.protocols import Camera, Frame

_EXAMPLES = """  retract calibrate stereo lab.toml --square 8.02 --marker 6.01
  retract calibrate cameras lab.toml --images views          left*.png and right*.png instead of live cameras
  retract calibrate robot lab.toml                           moves the gripper, with a bead on it
  retract calibrate force lab.toml                           tilts the gripper in free air
  retract calibrate time lab.toml --motion tap
  retract calibrate tool lab.toml                            touch a fixed point in several orientations
  retract calibrate time lab.toml --session runs/sway        evaluate once more what was recorded
  retract calibrate force virtual --output runs/calibration"""

_FRESH_FRAMES = 3
_MOST_IMAGE_BYTES = 100_000_000
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
        "--images", type=Path, metavar="DIR", help="views of the board, left*.png and right*.png"
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
    parser.add_argument("--legacy-pattern", action="store_true", help="printed by OpenCV before 4.6")


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
        return _from_board(options, rig, stored_views(options.images)), {}
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
            outcome = _from_board(options, rig, _live_views(devices, person))
        return outcome, serials_of(options.kind, serials)


def _by_touch(rig: Rig, devices: Devices, person: Person) -> Outcome[Any]:
    collected = ToolCalibration(flange_tool(rig))
    while person.touch_point(collected.figures.touches):
        told = collected.add(devices.robot.state().T_base_tool)
        sys.stderr.write(
            f"touch {told.touches}: turned by {told.turn_deg:.0f}°, off one point by {told.rms_m * 1e3:.3f} mm rms\n"
        )
    return collected.finish()


def _from_board(
    options: argparse.Namespace, rig: Rig, views: Iterator[tuple[NDArray[np.uint8], NDArray[np.uint8]]]
) -> Outcome[Any]:
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
    collected = BoardCalibration(board)
    for left, right in views:
        sys.stderr.write(f"{collected.add(left, right).describe()}\n")
    if options.kind == "cameras":
        return collected.finish_cameras()
    if options.kind == "stereo":
        return collected.finish_stereo(lying_on_phantom(board, rig))
    raise CalibrationError(f"{options.kind}: is not made from images of a board")


def _live_views(devices: Devices, person: Person) -> Iterator[tuple[NDArray[np.uint8], NDArray[np.uint8]]]:
    number = 0
    while person.show_board(number):
        left, right = (_fresh(camera) for camera in devices.cameras.values())
        yield left, right
        number += 1


def _fresh(camera: Camera) -> NDArray[np.uint8]:
    """Return an image that was exposed after the call."""
    while camera.read(0.0):
        pass
    seen: list[Frame] = []
    while len(seen) < _FRESH_FRAMES:
        frames = camera.read(_FRAME_TIMEOUT_S)
        if not frames:
            raise CalibrationError(
                f"cameras: no image in {_FRAME_TIMEOUT_S:g} s; check the camera and its light"
            )
        seen += frames
    return grey(seen[-1].image, seen[-1].pixel_format)


def stored_views(folder: Path) -> Iterator[tuple[NDArray[np.uint8], NDArray[np.uint8]]]:
    """Read pairs of views of the board, ``left*.png`` and ``right*.png``; raises CalibrationError."""
    left, right = (sorted(folder.glob(f"{side}*.png")) for side in ("left", "right"))
    if not left or len(left) != len(right):
        raise CalibrationError(
            f"{folder}: holds {len(left)} images left*.png and {len(right)} right*.png; give one pair for each view"
        )
    for pair in zip(left, right, strict=True):
        yield _stored_view(pair[0]), _stored_view(pair[1])


def _stored_view(path: Path) -> NDArray[np.uint8]:
    content = read_input(path, _MOST_IMAGE_BYTES)
    found = (
        cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_GRAYSCALE)
        if is_whole_png(content)
        else None
    )
    if found is None:
        raise CalibrationError(f"{path}: is no whole PNG image; take the view again, or leave the pair out")
    return np.asarray(found, dtype=np.uint8)
