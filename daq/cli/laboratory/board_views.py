"""Views of the calibration board for ``retract calibrate``: stored ones, or looked at while a person shows it."""

import argparse
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.acquisition.stereo_look import StereoLook
from daq.calibration.cameras import BoardCalibration, grey, lying_on_phantom
from daq.calibration.one_camera import OneCameraCalibration
from daq.calibration.stored_views import StoredViews, find_views, single_views
from daq.calibration_files.outcome import Outcome
from daq.cli.verb import progress
from daq.devices import Devices
from daq.errors import CalibrationError
from daq.rig import Rig
from daq.vision.charuco import CharucoBoard

_PASSED_OVER = 2  # images of each camera
_MOST_TRIES = 5  # of the first view
_LOOK_TIMEOUT_S = 15.0
_FRAME_TIMEOUT_S = 5.0


def from_stored(options: argparse.Namespace, rig: Rig) -> Outcome[Any]:
    """Calibrate from stored views; in the first of them the board lies on the phantom."""
    if options.kind == "camera":
        return _one_from_stored(options, rig)
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


def _one_from_stored(options: argparse.Namespace, rig: Rig) -> Outcome[Any]:
    board = _board(options)
    collected = OneCameraCalibration(board)
    first_is_there = False
    for number, (name, image) in enumerate(single_views(options.images)):
        _tell(f"{name}: {collected.add(image)}")
        first_is_there |= number == 0 and collected.views == 1
    if not first_is_there:
        _tell(
            "the first view was not taken: in it the board lies on the phantom, which tells where the tissue frame is"
        )
    with progress() as tell:
        return collected.finish(lying_on_phantom(board, rig), tell, first_is_there=first_is_there)


def _missing_first(stored: StoredViews) -> str:
    return "" if stored.names.first_paired else "the first image of all has no partner"


def _tolerance_s(options: argparse.Namespace) -> float:
    if not options.tolerance >= 0.0:
        raise CalibrationError(f"--tolerance {options.tolerance:g}: is a time in ms, 0 or more")
    return float(options.tolerance) * 1e-3


def from_live(
    options: argparse.Namespace, rig: Rig, devices: Devices, show_board: Callable[[int], bool]
) -> Outcome[Any]:
    """Calibrate from views that a person shows to the cameras, by number; in the first the board lies on the phantom.

    Raises
    ------
    CalibrationError
        The board was not found, or no two images of one moment came.
    """
    if options.kind == "camera":
        return _one_from_live(options, rig, devices, show_board)
    collected, board = _collection(options)
    number = tries = 0
    while show_board(number):
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


def _one_from_live(
    options: argparse.Namespace, rig: Rig, devices: Devices, show_board: Callable[[int], bool]
) -> Outcome[Any]:
    board = _board(options)
    collected = OneCameraCalibration(board)
    name = next(iter(devices.cameras))
    while show_board(collected.views):
        _tell(collected.add(_fresh_image(devices, name)))
    with progress() as tell:
        return collected.finish(lying_on_phantom(board, rig), tell)


def _fresh_image(devices: Devices, name: str) -> NDArray[np.uint8]:
    """Return a grey image of one camera that was exposed after the call."""
    while devices.cameras[name].read(0.0):
        pass
    seen = 0
    while seen <= _PASSED_OVER:
        frames = devices.cameras[name].read(_FRAME_TIMEOUT_S)
        if not frames:
            raise CalibrationError(
                f"camera {name}: no image in {_FRAME_TIMEOUT_S:g} s; check the camera and its light"
            )
        seen += len(frames)
    return grey(frames[-1].image, frames[-1].pixel_format)


def _collection(options: argparse.Namespace) -> tuple[BoardCalibration, CharucoBoard]:
    if options.kind not in ("cameras", "stereo"):
        raise CalibrationError(f"{options.kind}: is not made from images of a board")
    board = _board(options)
    return BoardCalibration(board), board


def _board(options: argparse.Namespace) -> CharucoBoard:
    try:
        return CharucoBoard(
            options.columns,
            options.rows,
            options.square * 1e-3,
            options.marker * 1e-3,
            options.dictionary,
            options.legacy_pattern,
        )
    except ValueError as error:
        raise CalibrationError(f"calibrate: {error}") from error


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
    look, pair = StereoLook(), tuple(devices.cameras)[:2]
    if len(pair) < 2:
        raise CalibrationError("cameras: the rig has one; a stereo pair is calibrated from images of two")
    for name in pair:
        while devices.cameras[name].read(0.0):
            pass
    look.ask()
    deadline = time.monotonic() + _LOOK_TIMEOUT_S
    seen = dict.fromkeys(pair, 0)
    while time.monotonic() < deadline:
        for name in pair:
            frames = devices.cameras[name].read(_FRAME_TIMEOUT_S)
            if not frames:
                raise CalibrationError(
                    f"camera {name}: no image in {_FRAME_TIMEOUT_S:g} s; check the camera and its light"
                )
            # what lay on its way when the board was shown is passed over
            fresh = frames[max(0, _PASSED_OVER - seen[name]) :]
            seen[name] += len(frames)
            look.add(name, fresh)
        if found := look.take(pair):
            left, right = (grey(frame.image, frame.pixel_format) for frame in found.values())
            return left, right
    raise CalibrationError(
        f"cameras: no two images of one moment in {_LOOK_TIMEOUT_S:g} s; start both at one frame rate, or "
        "synchronise them"
    )
