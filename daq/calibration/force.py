"""The tool's weight and centre, the sensor's offset and its noise, from windows in several orientations in free air."""

import math

import numpy as np
from matplotlib.figure import Figure as Plot

from daq.calibration_files.outcome import Figure, Outcome
from daq.calibration_files.results import ForceResult, Six
from daq.errors import CalibrationError
from daq.frames import quaternions_wxyz, rotation
from daq.progress import Progress, silent
from daq.recording.folder import RIG_FILE
from daq.recording.reader import Recording
from daq.rig import read_rig
from daq.synchronisation.experiment_rows import gripper_in_tissue
from daq.synchronisation.stream_times import force_times, robot_times
from daq.synchronisation.windows import in_window, measuring_windows, scatter_of_mean
from robot_drivers.ati.compensation.gravity import gravity_in_sensor, identify_tool
from robot_drivers.errors import ConfigurationError
from robot_drivers.protocols import FloatArray

LEAST_TILT_DEG = 15.0
MOST_FORCE_RMS_N = 0.05
MOST_TORQUE_RMS_NM = 0.005
MOST_MASS_STD_KG = 0.005
MOST_CENTRE_STD_M = 0.001

_CHANNELS = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")


def calibrate_force(recording: Recording, progress: Progress = silent) -> Outcome[ForceResult]:
    """Find what hangs on the force sensor from a recording of :func:`daq.trajectories.routines.tare_poses` in free air.

    ``progress`` is told what is done; the tool follows in closed form, without iterations.

    Raises
    ------
    CalibrationError
        The windows do not determine the tool; the message names what to add.
    SynchronisationError
        The recording has no window.
    """
    rig = read_rig(recording.folder / RIG_FILE, to_connect=False)
    windows = measuring_windows(recording.events)
    progress(f"weighing the tool in {len(windows)} poses", 0, 1)
    force, robot = recording.force, recording.robot
    taken, stood = force_times(force, rig), robot_times(robot)
    _, gripper = gripper_in_tissue(robot, rig.frames)
    R_gripper_sensor = rotation(rig.frames.T_gripper_sensor.quaternion_wxyz)
    orientations, readings, scatters, noises = [], [], [], []
    for window in windows:
        samples = force.wrench[in_window(taken, window) & force.usable]
        turned = gripper[in_window(stood, window)]
        if len(samples) < 8 or len(turned) == 0:
            raise CalibrationError(
                f"force: the window at pose {window.number} holds {len(samples)} usable force samples and "
                f"{len(turned)} states of the robot; record again"
            )
        orientations.append(quaternions_wxyz(rotation(turned).mean() * R_gripper_sensor))
        readings.append(samples.mean(axis=0))
        scatters.append(scatter_of_mean(samples))
        noises.append(samples.std(axis=0, ddof=1))
    gravity = gravity_in_sensor(np.array(orientations), rig.specimen.environment.gravity)
    try:
        tool = identify_tool(gravity, readings, _floored(np.array(scatters)))
    except ConfigurationError as error:
        raise CalibrationError(f"force: {error}") from error
    left = np.array(readings) - np.array([tool.reading(direction) for direction in gravity])
    centre = R_gripper_sensor.apply(tool.centre_m) + rig.frames.T_gripper_sensor.position_m
    centre_std = np.sqrt(np.diag(_turned(tool.centre_covariance, R_gripper_sensor.as_matrix())))
    result = ForceResult(
        mass_kg=tool.mass_kg,
        mass_std_kg=tool.mass_std_kg,
        centre_m=(float(centre[0]), float(centre[1]), float(centre[2])),
        centre_std_m=(float(centre_std[0]), float(centre_std[1]), float(centre_std[2])),
        offset=_six(tool.bias),
        offset_std=_six(np.sqrt(np.diag(tool.covariance)[4:])),
        noise_std=_six(np.sqrt(np.mean(np.square(noises), axis=0))),
    )
    figures = (
        Figure("poses", float(len(windows)), "", least=5.0),
        Figure("largest tilt", _largest_tilt_deg(gravity), "°", least=LEAST_TILT_DEG),
        Figure("mass, standard deviation", result.mass_std_kg, "kg", most=MOST_MASS_STD_KG),
        Figure("centre, standard deviation", max(result.centre_std_m), "m", most=MOST_CENTRE_STD_M),
        Figure("force not explained, rms", _rms(left[:, :3]), "N", most=MOST_FORCE_RMS_N),
        Figure("torque not explained, rms", _rms(left[:, 3:]), "N m", most=MOST_TORQUE_RMS_NM),
        *(
            Figure(f"noise of one sample, {channel}", std, unit)
            for channel, std, unit in zip(_CHANNELS, result.noise_std, ("N",) * 3 + ("N m",) * 3, strict=True)
        ),
    )

    def draw(plot: Plot) -> None:
        for axes, rows, unit in zip(
            plot.subplots(1, 2), (slice(0, 3), slice(3, 6)), ("N", "N m"), strict=True
        ):
            axes.plot(left[:, rows], "o-", label=_CHANNELS[rows])
            axes.set(xlabel="pose", ylabel=f"reading less model, {unit}")
            axes.legend()

    return Outcome("force", result, figures, draw)


def _floored(scatter: FloatArray) -> FloatArray:
    """Return deviations of the means; four parts of a window tell them poorly, so the windows are pooled."""
    pooled = np.sqrt(np.nanmean(np.square(scatter), axis=0))
    return np.broadcast_to(np.maximum(pooled, [1e-4] * 3 + [1e-5] * 3), scatter.shape)


def _turned(covariance: FloatArray, R: FloatArray) -> FloatArray:
    return np.asarray(R @ covariance @ R.T)


def _largest_tilt_deg(gravity: FloatArray) -> float:
    directions = gravity / np.linalg.norm(gravity, axis=1, keepdims=True)
    return math.degrees(math.acos(float(np.clip(directions @ directions[0], -1.0, 1.0).min())))


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _six(values: FloatArray) -> Six:
    a, b, c, d, e, f = (float(value) for value in values)
    return (a, b, c, d, e, f)
