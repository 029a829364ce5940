"""What an experiment must fulfil before anything is computed from it.

Bounds are generous: they catch a wrong unit, frame or sign, never an unusual phantom.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.experiment.model import (
    BEAD_CHANNELS,
    EXPERIMENT_FILE,
    OBSERVATIONS_FILE,
    WRENCH_CHANNELS,
    Experiment,
    Phantom,
)
from estimator.experiment.observations import WRENCH_COLUMNS, fiducial_columns, line_of_row
from estimator.experiment.support import check_support

_SIZE_LIMIT_M = 2.0
_DENSITY_RANGE = (100.0, 20_000.0)
_GRAVITY_LIMIT = 20.0
_TOOL_MASS_LIMIT_KG = 50.0
_ORIENTATION_NOISE_LIMIT = 0.5
_FORCE_LIMIT_N = 400.0  # the largest range of a Gamma calibration along z
_TORQUE_LIMIT_NM = 20.0
# in longest edges of the phantom:
_REST_TOLERANCE = 0.05  # fiducials off its surface, gripper off its stated start
_TRAVEL_LIMIT = 10.0  # any observed point away from its centre
_NOISE_LIMIT = 0.1  # scatter of one position
_SIGN_TRAVEL = 0.02  # travel below which a force tells nothing of its sign

_QUATERNION_TOLERANCE = 1e-3
_REST_ANGLE_LIMIT_DEG = 5.0
_SIGN_ROWS = 5
_SIGN_NOISE = 20.0  # standard deviations by which the force must vary to be judged
_SIGN_CORRELATION = 0.9


def check_experiment(experiment: Experiment) -> None:
    """Check everything that is stated and observed, each against the phantom's size and what tissue can do.

    Raises
    ------
    InputError
        At the first thing that cannot be right, as one line.
    """
    folder = experiment.path or Path(experiment.name)
    stated, observed = folder / EXPERIMENT_FILE, folder / OBSERVATIONS_FILE
    _check_phantom(experiment.phantom, stated)
    check_support(experiment, stated, observed)
    _check_environment_and_sensor(experiment, stated)
    _check_lengths(experiment, observed)
    _check_time_and_pose(experiment, observed)
    _check_start(experiment, observed)
    _check_measurements(experiment, observed)
    _check_force_sign(experiment, observed)


def _check_phantom(phantom: Phantom, file: Path) -> None:
    if phantom.stays_flat and phantom.surface is not None:
        raise InputError(f"{file}: [phantom] stays_flat is for phantoms of shape block; leave it out")
    if not min(phantom.size_m) > 0:
        raise InputError(f"{file}: [phantom] size is {list(phantom.size_m)}; every edge must be above 0 m")
    if (longest := max(phantom.size_m)) > _SIZE_LIMIT_M:
        raise InputError(
            f"{file}: [phantom] size has an edge of {longest:g} m; write metres, not millimetres"
        )
    low, high = _DENSITY_RANGE
    if not low <= phantom.density <= high:
        raise InputError(
            f"{file}: [phantom] density is {phantom.density:g} kg/m3, not in {low:g} to {high:g}; write kg/m3"
        )


def _check_environment_and_sensor(experiment: Experiment, file: Path) -> None:
    sensor, longest = experiment.sensor, max(experiment.phantom.size_m)
    for name, unit in (
        ("force_std", "N"),
        ("torque_std", "N·m"),
        ("fiducial_std", "m"),
        ("position_std", "m"),
    ):
        std = getattr(sensor, name)
        if not std > 0:
            raise InputError(f"{file}: [sensor] {name} is {std:g}; a standard deviation is above 0 {unit}")
        if unit == "m" and std > _NOISE_LIMIT * longest:
            raise InputError(
                f"{file}: [sensor] {name} is {std:g} m on a phantom of {longest:g} m; write metres"
            )
    for name, std in sensor.by_channel.items():
        if name not in (*WRENCH_CHANNELS, *BEAD_CHANNELS) or not std > 0:
            raise InputError(
                f"{file}: [sensor.by_channel] {name} is {std:g}; name one of fx fy fz tx ty tz x y z, with a "
                "standard deviation above 0"
            )
    if not 0 <= sensor.orientation_std <= _ORIENTATION_NOISE_LIMIT:
        raise InputError(
            f"{file}: [sensor] orientation_std is {sensor.orientation_std:g} rad; write radians, 0 or more"
        )
    if experiment.driven == "load" and not sensor.orientation_std:
        raise InputError(
            f'{file}: [trajectory] driven is "load", so that the orientation of the gripper was measured; state '
            "[sensor] orientation_std in rad (by markers: their position_std over their distance)"
        )
    if not 0 <= sensor.tool_mass <= _TOOL_MASS_LIMIT_KG:
        raise InputError(
            f"{file}: [sensor] tool_mass is {sensor.tool_mass:g} kg; write 0 or more, in kilograms"
        )
    if np.linalg.norm(sensor.tool_centre) > _SIZE_LIMIT_M:
        raise InputError(f"{file}: [sensor] tool_centre is metres away from the gripper; write metres")
    gravity = float(np.linalg.norm(experiment.environment.gravity))
    if gravity > _GRAVITY_LIMIT:
        raise InputError(f"{file}: [environment] gravity is {gravity:g} m/s2 in all; write m/s2")
    _check_weight(experiment, file)


def _check_weight(experiment: Experiment, file: Path) -> None:
    environment = experiment.environment
    if environment.weight == "left_out":
        return
    if not any(environment.gravity):
        raise InputError(
            f'{file}: [environment] weight is "{environment.weight}" and gravity is zero; state gravity in m/s2'
        )
    if environment.surface_below == "table":
        raise InputError(
            f'{file}: [environment] weight is "{environment.weight}" and a table carries the phantom; write '
            'surface_below = "none" where nothing but the anchors does, or weight = "left_out"'
        )
    if environment.weight == "acts_after_first_row" and experiment.first_row == "under_load":
        raise InputError(
            f'{file}: [trajectory] first_row is "under_load" and the weight acts only after it; write '
            'weight = "acts"'
        )


def _check_lengths(experiment: Experiment, file: Path) -> None:
    n, m = len(experiment.time), len(experiment.fiducials_rest)
    expected = {
        "phase": (n,),
        "step": (n,),
        "position": (n, 3),
        "quaternion_wxyz": (n, 4),
        "wrench": (n, 6),
        "fiducials": (n, m, 3),
    }
    for name, shape in expected.items():
        if (found := np.shape(getattr(experiment, name))) != shape:
            raise InputError(f"{file}: {name} has the shape {found}; with {n} times it must be {shape}")
    fewest = 1 if experiment.first_row == "under_load" else 2
    if n < fewest:
        raise InputError(f"{file}: {n} rows; a retraction needs at least two")


def _check_time_and_pose(experiment: Experiment, file: Path) -> None:
    pose = np.column_stack([experiment.time, experiment.position, experiment.quaternion_wxyz])
    _refuse_rows(np.any(~np.isfinite(pose), axis=1), file, "time or pose is not finite; leave the row out")
    late = np.concatenate([[False], np.diff(experiment.time) <= 0])
    _refuse_rows(late, file, "time does not ascend; sort the rows and remove doubles", "time")
    norm = np.linalg.norm(experiment.quaternion_wxyz, axis=1)
    _refuse_rows(
        np.abs(norm - 1) > _QUATERNION_TOLERANCE,
        file,
        "the orientation is no unit quaternion; write qw qx qy qz with norm 1",
        "qw",
    )
    _refuse_rows(experiment.step < 0, file, "the step is negative; number the steps from 0", "step")


def _check_start(experiment: Experiment, file: Path) -> None:
    longest = max(experiment.phantom.size_m)
    travel = np.linalg.norm(experiment.position, axis=1)
    _refuse_rows(
        travel > _TRAVEL_LIMIT * longest,
        file,
        f"the gripper is more than {_TRAVEL_LIMIT:g} phantoms away; write metres in the tissue frame",
        "px",
    )
    if experiment.first_row == "under_load":
        return
    off = float(np.linalg.norm(experiment.position[0] - experiment.grasp.centre))
    if off > _REST_TOLERANCE * longest:
        raise InputError(
            f"{file}, line {line_of_row(0)}: the gripper starts {off:g} m off [grasp] centre; the first row "
            "is at rest: correct the centre, express the positions in the tissue frame, in metres, or write "
            'first_row = "under_load" in [trajectory]'
        )
    angle = 2 * np.degrees(np.arccos(min(1.0, abs(float(experiment.quaternion_wxyz[0, 0])))))
    if angle > _REST_ANGLE_LIMIT_DEG:
        raise InputError(
            f"{file}, line {line_of_row(0)}: the gripper starts turned by {angle:.1f} degrees; write its "
            "orientation relative to rest, scalar first (1, 0, 0, 0 at rest), or write "
            'first_row = "under_load" in [trajectory]'
        )


def _check_measurements(experiment: Experiment, file: Path) -> None:
    wrench, fiducials = experiment.wrench, experiment.fiducials
    if np.isnan(wrench).all() and np.isnan(fiducials).all():
        raise InputError(f"{file}: neither a wrench nor a fiducial is given; export the measurements too")
    for kind, limit, unit in ((slice(0, 3), _FORCE_LIMIT_N, "N"), (slice(3, 6), _TORQUE_LIMIT_NM, "N·m")):
        text = f"the wrench exceeds {limit:g} {unit}, which no soft tissue bears; write N and N·m"
        _refuse_values(np.abs(wrench[:, kind]) > limit, file, text, WRENCH_COLUMNS[kind])
    limit_m = _TRAVEL_LIMIT * max(experiment.phantom.size_m)
    _refuse_values(
        np.abs(fiducials).reshape(len(fiducials), -1) > limit_m,
        file,
        f"a fiducial is more than {limit_m:g} m away from the phantom's centre; write metres",
        fiducial_columns(fiducials.shape[1]),
    )


def _check_force_sign(experiment: Experiment, file: Path) -> None:
    """Refuse forces that grow along the motion as strictly as an elastic reaction grows against it.

    A phantom whose weight acts may pull the gripper along.
    """
    if experiment.environment.weight != "left_out":
        return
    travel = experiment.position - experiment.position[0]
    distance = np.linalg.norm(travel, axis=1)
    force = experiment.wrench[:, :3]
    far = distance > _SIGN_TRAVEL * max(experiment.phantom.size_m)
    used = far & np.all(np.isfinite(force), axis=1)
    if np.count_nonzero(used) < _SIGN_ROWS:
        return
    along = np.einsum("ij,ij->i", force[used], travel[used]) / distance[used]
    if np.ptp(along) < _SIGN_NOISE * experiment.sensor.force_std or np.ptp(distance[used]) == 0:
        return
    correlation = np.corrcoef(along, distance[used])[0, 1]
    if along.mean() > 0 and correlation > _SIGN_CORRELATION:
        raise InputError(
            f"{file}: the force grows along the gripper's motion; write the force that the tissue exerts on "
            "the gripper (negative fx when pulling along +x)"
        )


def _refuse_rows(refused: NDArray[np.bool_], file: Path, text: str, column: str | None = None) -> None:
    if refused.any():
        line = line_of_row(int(np.argmax(refused)))
        raise InputError(f"{file}, line {line}{f', column {column}' if column else ''}: {text}")


def _refuse_values(refused: NDArray[np.bool_], file: Path, text: str, columns: tuple[str, ...]) -> None:
    rows, places = np.nonzero(refused)
    if len(rows):
        raise InputError(f"{file}, line {line_of_row(int(rows[0]))}, column {columns[places[0]]}: {text}")
