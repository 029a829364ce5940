"""Views of the calibration board for ``retract calibrate``: stored ones, or looked at while a person shows it."""

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.acquisition.stereo_look import StereoLook
from daq.calibration.by_board import SEEN_BY, calibrate_by_board
from daq.calibration.collected_views import BoardViews, grey
from daq.calibration.stored_views import find_views, single_views
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

_Together = tuple[NDArray[np.uint8], ...]
"""Images of one moment, one of each camera that sees the board."""


def from_stored(options: argparse.Namespace, rig: Rig) -> Outcome[Any]:
    """Calibrate from stored views; in the first of them the board lies on the phantom."""
    views = _collection(options)
    missing, stored = _stored(options, len(views.sides))
    for number, (name, images) in enumerate(stored):
        told = views.add(*images, name=name)
        _tell(f"{name}: {told.describe()}")
        if number == 0 and told.problem:
            missing = f"{name} was not taken"
    if missing and options.kind != "cameras":
        _tell(
            f"{missing}: in the first view the board lies on the phantom, which tells where the tissue frame is"
        )
    return _finished(options, rig, views, first_is_there=not missing)


def _stored(options: argparse.Namespace, sides: int) -> tuple[str, Iterator[tuple[str, _Together]]]:
    """Return why the first of the stored views is not there, empty if it is, and the views by their names."""
    if sides == 1:
        return "", ((name, (image,)) for name, image in single_views(options.images))
    marks = None if options.sides is None else (options.sides[0], options.sides[1])
    stored = find_views(options.images, marks, _tolerance_s(options))
    _tell(stored.describe())
    missing = "" if stored.names.first_paired else "the first image of all has no partner"
    return missing, ((view.name, (view.left, view.right)) for view in stored.read())


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
        The board was not found, or no images of one moment came.
    """
    views = _collection(options)
    number = tries = 0
    while show_board(number):
        told = views.add(*_look(devices, len(views.sides)))
        _tell(told.describe())
        tries += 1
        # until it is taken, the first view is asked for again: only it shows the board at its known place
        number += told.views > 0
        if not told.views and tries == _MOST_TRIES:
            raise CalibrationError(
                f"{options.kind}: the board was not found in {tries} views ({told.problem})"
            )
    return _finished(options, rig, views)


def _collection(options: argparse.Namespace) -> BoardViews:
    if options.kind not in SEEN_BY:
        raise CalibrationError(f"{options.kind}: is not made from images of a board")
    return BoardViews(_board(options), SEEN_BY[options.kind])


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
    options: argparse.Namespace, rig: Rig, views: BoardViews, *, first_is_there: bool = True
) -> Outcome[Any]:
    with progress() as tell:
        return calibrate_by_board(options.kind, views, rig, tell, first_is_there=first_is_there)


def _tell(words: str) -> None:
    sys.stderr.write(f"{words}\n")
    sys.stderr.flush()


def _look(devices: Devices, sides: int) -> _Together:
    """Return an image of each of the first so many cameras, exposed together after the call."""
    look, names = StereoLook(), tuple(devices.cameras)[:sides]
    for name in names:
        while devices.cameras[name].read(0.0):
            pass
    look.ask()
    deadline = time.monotonic() + _LOOK_TIMEOUT_S
    seen = dict.fromkeys(names, 0)
    while time.monotonic() < deadline:
        for name in names:
            frames = devices.cameras[name].read(_FRAME_TIMEOUT_S)
            if not frames:
                raise CalibrationError(
                    f"camera {name}: no image in {_FRAME_TIMEOUT_S:g} s; check the camera and its light"
                )
            # what lay on its way when the board was shown is passed over
            fresh = frames[max(0, _PASSED_OVER - seen[name]) :]
            seen[name] += len(frames)
            look.add(name, fresh)
        if found := look.take(names):
            return tuple(grey(frame.image, frame.pixel_format) for frame in found.values())
    raise CalibrationError(
        f"cameras: no two images of one moment in {_LOOK_TIMEOUT_S:g} s; start both at one frame rate, or "
        "synchronise them"
    )
