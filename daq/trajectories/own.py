"""Trajectories of one's own: from a table, or from a Python function of the fraction of the way.

A table is a CSV file whose header names its columns: ``x_m``, ``y_m``, ``z_m`` (position of the gripper relative to
its rest pose, tissue frame), ``rx_rad``, ``ry_rad``, ``rz_rad`` (its rotation vector), ``settle_s``, ``measure_s``
and ``phase`` (``hold`` or ``return_hold``). The position is needed, the rest may be missing. A row that says
``measure_s`` 0 is passed through.
"""

import csv
import importlib.util
import io
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from daq.errors import TrajectoryError
from daq.frames import IDENTITY, pose
from daq.trajectories.trajectory import STANDARD_SPEED, Dwell, Step, Trajectory
from estimator.errors import InputError
from estimator.input_file import parse_number, read_input_text
from robot_drivers.protocols import Pose, Speed

_POSITION = ("x_m", "y_m", "z_m")
_TURN = ("rx_rad", "ry_rad", "rz_rad")
_TIMES = ("settle_s", "measure_s")
_COLUMNS = (*_POSITION, *_TURN, *_TIMES, "phase")


def read_table(path: Path, speed: Speed = STANDARD_SPEED, dwell: Dwell | None = None) -> Trajectory:
    """Read a trajectory from a CSV table; ``dwell`` gives the times that the table leaves out.

    Raises
    ------
    TrajectoryError
        Naming file, line and column of what is wrong.
    """
    dwell = dwell or Dwell()
    try:
        rows = list(csv.DictReader(io.StringIO(read_input_text(path), newline=""), skipinitialspace=True))
    except InputError as error:
        raise TrajectoryError(str(error)) from error
    except csv.Error as error:
        raise TrajectoryError(
            f"{path}: not readable as CSV: {error}; save it as comma-separated UTF-8"
        ) from error
    if not rows:
        raise TrajectoryError(f"{path}: has no row below its header; write one row for each step")
    present = set(rows[0])
    if missing := [name for name in _POSITION if name not in present]:
        raise TrajectoryError(f"{path}, line 1: column {missing[0]} is missing; add it")
    if unknown := [str(name) for name in present if name not in _COLUMNS]:
        raise TrajectoryError(f"{path}, line 1: column {unknown[0]} is unknown; use {', '.join(_COLUMNS)}")
    steps = [Step(0, "hold", IDENTITY, dwell.settle_s, dwell.rest_s)]
    for number, row in enumerate(rows, start=1):
        where = f"{path}, line {number + 1}"
        phase = row.get("phase") or "hold"
        if phase not in ("hold", "return_hold"):
            raise TrajectoryError(f"{where}, column phase: {phase!r} is neither hold nor return_hold")
        turn = Rotation.from_rotvec([_number(row, name, 0.0, where) for name in _TURN])
        position = [_number(row, name, None, where) for name in _POSITION]
        settle_s, measure_s = (
            _number(row, name, usual, where)
            for name, usual in zip(_TIMES, (dwell.settle_s, dwell.measure_s), strict=True)
        )
        if min(settle_s, measure_s) < 0:
            raise TrajectoryError(f"{where}: settle_s and measure_s must not be negative")
        steps.append(
            Step(
                number,
                "hold" if phase == "hold" else "return_hold",
                pose(position, turn),
                settle_s,
                measure_s,
            )
        )
    return Trajectory(path.stem, speed, tuple(steps))


def load_function(path: Path, name: str) -> Callable[[float], Pose]:
    """Load a function of a Python file that returns ``T_rest_gripper`` for a fraction (0 to 1) of the way out.

    The file is run: use only files that you would run yourself.

    Raises
    ------
    TrajectoryError
        There is no such file or function, or the function does not return a pose.
    """
    specification = importlib.util.spec_from_file_location(path.stem, path)
    if not path.is_file() or specification is None or specification.loader is None:
        raise TrajectoryError(f"{path}: is no Python file; name one, such as paths.py:{name}")
    module = importlib.util.module_from_spec(specification)
    try:
        specification.loader.exec_module(module)
    except Exception as error:
        raise TrajectoryError(f"{path}: cannot be run ({error!r}); correct it there") from error
    function = getattr(module, name, None)

    def path_of(fraction: float) -> Pose:
        try:
            found = function(fraction) if callable(function) else None
        except Exception as error:
            raise TrajectoryError(
                f"{path}: {name}({fraction:g}) fails ({error!r}); correct it there"
            ) from error
        if not isinstance(found, Pose):
            raise TrajectoryError(
                f"{path}: {name} is no function that returns a robot_drivers.protocols.Pose for a number from 0 to 1"
            )
        if not np.all(np.isfinite([*found.position, *found.quaternion_wxyz])):
            raise TrajectoryError(
                f"{path}: {name}({fraction:g}) is {found}, which is not finite; correct it there"
            )
        return found

    path_of(0.0)
    return path_of


def _number(row: dict[str, str], name: str, usual: float | None, where: str) -> float:
    text = (row.get(name) or "").strip()
    if not text and usual is not None:
        return usual
    try:
        value = parse_number(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise TrajectoryError(f"{where}, column {name}: {text!r} is no finite number; write one")
    return value
