"""Where the tissue frame is in the robot's base frame: by a marker on the gripper that the cameras see, or by touch.

The calibrated cameras measure in the tissue frame. A bead on the gripper, at an unknown place m in the tool frame, is
seen at p_i while the robot reports T_i: T_base_tissue p_i = T_i m for every pose i. The pose of the cameras in the base
frame follows from the same. Without cameras, points of known place in the tissue frame are touched with the gripper.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure as Plot
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from daq.calibration_files.outcome import TURN_STD, Figure, Outcome
from daq.calibration_files.results import RobotResult
from daq.errors import CalibrationError
from daq.frames import compose, inverse, pose, rotation
from daq.progress import Progress, silent
from daq.recording.folder import RIG_FILE
from daq.recording.reader import Recording
from daq.rig import Rig, Transform, Vector, read_rig
from daq.synchronisation.stereo_images import StereoImages
from daq.synchronisation.stream_times import robot_times
from daq.synchronisation.windows import Window, in_window, measuring_windows
from daq.vision.beads import detect_beads
from daq.vision.camera_model import StereoCalibration
from daq.vision.stereo import match
from robot_drivers.protocols import FloatArray, Pose

FEWEST_POSES = 8
FEWEST_LANDMARKS = 4
MOST_RMS_M = 1e-4
MOST_TOUCH_RMS_M = 5e-4
MOST_STD_RATIO = (
    5.0  # of the tissue frame's origin, which lies beside the points, to one coordinate of a point
)
MOST_TURN_STD_DEG = 0.3
LEAST_SPREAD_M = 0.003

_MOST_STEPS = 200
_STILL_M = 5e-4
_SEEN_AGAIN = 3  # a point has to be seen in so many images of a window, or in all of fewer


def calibrate_robot(recording: Recording, progress: Progress = silent) -> Outcome[RobotResult]:
    """Register robot, cameras and tissue from a recording of :func:`daq.trajectories.routines.marker_poses`.

    One marker has to sit on the gripper; what stands still through all poses is not it. ``progress`` is told each pose.

    Raises
    ------
    CalibrationError
        No single marker is seen in enough poses, or the poses do not determine the registration.
    """
    rig = read_rig(recording.folder / RIG_FILE, to_connect=False)
    windows = measuring_windows(recording.events)
    stereo = rig.stereo()
    images = StereoImages(recording, rig)
    found_in = []
    for number, window in enumerate(windows):
        progress("looking for the marker in the images of each pose", number, len(windows))
        found_in.append(_seen_points(images, rig, stereo, window))
    seen = _without_still(found_in)
    robot = recording.robot
    times = robot_times(robot)
    tools, points = [], []
    for window, found in zip(windows, seen, strict=True):
        inside = in_window(times, window)
        if len(found) == 1 and inside.any():
            turn = rotation(robot.quaternion_wxyz[inside]).mean()
            tools.append(pose(robot.position[inside].mean(axis=0), turn))
            points.append(found[0])
    if len(points) < FEWEST_POSES:
        raise CalibrationError(
            f"robot: a single moving marker is seen in {len(points)} of {len(windows)} poses, not {FEWEST_POSES}; "
            "put one bead on the gripper where both cameras see it, and cover what else moves"
        )
    progress(f"registering robot and cameras by {len(points)} poses", 0, 1)
    return register_marker(tools, np.array(points), rig, stereo)


def register_marker(
    T_base_tool: Sequence[Pose], points: FloatArray, rig: Rig, stereo: StereoCalibration
) -> Outcome[RobotResult]:
    """Register from poses of the robot and the places (n, 3), tissue frame, where the cameras saw the marker.

    Raises
    ------
    CalibrationError
        The poses do not determine the registration, for which they need turns about two axes, or do not fit together.
    """
    rotations = rotation(np.array([tool.quaternion_wxyz for tool in T_base_tool]))
    origins = np.array([tool.position for tool in T_base_tool])

    def residuals(parameters: FloatArray) -> FloatArray:
        marker = origins + rotations.apply(parameters[6:])
        seen = Rotation.from_rotvec(parameters[:3]).apply(points) + parameters[3:6]
        return np.asarray((marker - seen).ravel())

    believed = rig.frames.T_base_tissue.pose
    start = np.concatenate([rotation(believed.quaternion_wxyz).as_rotvec(), believed.position, np.zeros(3)])
    solution = least_squares(residuals, start, x_scale="jac", max_nfev=_MOST_STEPS)
    jacobian = np.asarray(solution.jac)
    if np.linalg.matrix_rank(jacobian, tol=1e-9 * np.linalg.norm(jacobian)) < 9:
        raise CalibrationError(
            "robot: the poses do not tell the marker from the frame; turn the gripper about two axes and more"
        )
    if not solution.success:
        raise CalibrationError(
            f"robot: has not converged in {_MOST_STEPS} steps; the poses and what the cameras saw do not fit together, "
            "record the motion again"
        )
    left = solution.fun.reshape(-1, 3)
    covariance = np.sum(left**2) / max(left.size - 9, 1) * np.linalg.inv(jacobian.T @ jacobian)
    T_base_tissue = pose(solution.x[3:6], Rotation.from_rotvec(solution.x[:3]))
    found = _Registration(T_base_tissue, solution.x[6:], covariance[:6, :6], points, left)
    return _outcome(found, stereo, MOST_RMS_M)


def register_landmarks(
    touched: FloatArray, landmarks: FloatArray, stereo: StereoCalibration
) -> Outcome[RobotResult]:
    """Register from points touched with the gripper, (n, 3) in the base frame, and their places in the tissue frame.

    Source: Kabsch, Acta Crystallographica A 32 (1976); Umeyama, IEEE TPAMI 13(4), 1991, for the reflection.

    Raises
    ------
    CalibrationError
        Fewer than four points, or all of them on a line.
    """
    centred = landmarks - landmarks.mean(axis=0)
    if len(landmarks) < FEWEST_LANDMARKS or np.linalg.matrix_rank(centred, tol=1e-3) < 2:
        raise CalibrationError(
            f"robot: {len(landmarks)} landmarks; touch {FEWEST_LANDMARKS} or more that do not lie on one line"
        )
    turn, _ = Rotation.align_vectors(touched - touched.mean(axis=0), centred)
    origin = touched.mean(axis=0) - turn.apply(landmarks.mean(axis=0))
    left = touched - turn.apply(landmarks) - origin
    jacobian = np.concatenate([np.hstack([_cross(turn.apply(point)), np.eye(3)]) for point in landmarks])
    covariance = np.sum(left**2) / (left.size - 6) * np.linalg.inv(jacobian.T @ jacobian)
    found = _Registration(pose(origin, turn), np.zeros(3), covariance, landmarks, left)
    return _outcome(found, stereo, MOST_TOUCH_RMS_M)


@dataclass(frozen=True, slots=True)
class _Registration:
    """Where the tissue frame was found, and how well.

    Attributes
    ----------
    T_base_tissue : Pose
    marker : (3,) the marker in the gripper's frame, m
    covariance : (6, 6) of the frame's turn, rad, and of its origin, m
    points, left : (n, 3) what it was registered from, and what is not explained of that, m
    """

    T_base_tissue: Pose
    marker: FloatArray
    covariance: FloatArray
    points: FloatArray
    left: FloatArray


def _outcome(found: _Registration, stereo: StereoCalibration, most_rms_m: float) -> Outcome[RobotResult]:
    """Judge a registration."""
    variance, left = np.diag(found.covariance), found.left
    std, rms = float(np.sqrt(variance[3:].max())), float(np.sqrt(np.mean(left**2)))
    turn_std_deg = math.degrees(float(np.sqrt(variance[:3].max())))
    T_base_camera = compose(found.T_base_tissue, inverse(stereo.left.T_cam_tissue))
    result = RobotResult(
        _transform(found.T_base_tissue), _transform(T_base_camera), _vector(found.marker), std, rms
    )
    spread = float(np.sqrt(np.linalg.eigvalsh(np.cov(found.points.T))[1]))
    figures = (
        Figure("poses", float(len(found.points)), "", least=float(FEWEST_LANDMARKS)),
        Figure("spread of the points across", spread, "m", least=LEAST_SPREAD_M),
        Figure("not explained, rms a coordinate", rms, "m", most=most_rms_m),
        Figure("origin of the tissue frame, standard deviation", std, "m", most=MOST_STD_RATIO * most_rms_m),
        Figure(TURN_STD, turn_std_deg, "°", most=MOST_TURN_STD_DEG),
    )

    def draw(plot: Plot) -> None:
        axes = plot.subplots()
        axes.plot(1e3 * left, "o-", label=("x", "y", "z"))
        axes.set(xlabel="pose", ylabel="robot less registered point, mm")
        axes.legend()

    return Outcome("robot", result, figures, draw)


def _seen_points(images: StereoImages, rig: Rig, stereo: StereoCalibration, window: Window) -> FloatArray:
    """Return the places (m, 3) of what both cameras saw again and again in a window."""
    chosen = (images.exposed_ns >= window.begin_ns) & (images.exposed_ns <= window.end_ns)
    found = [
        match(
            stereo,
            detect_beads(left, rig.vision.beads),
            detect_beads(right, rig.vision.beads),
            rig.vision.stereo,
        ).points.positions
        for left, right in images.decoded(chosen)
    ]
    every = np.concatenate(found) if found else np.empty((0, 3))
    places: list[FloatArray] = []
    while len(every):
        near = np.linalg.norm(every - every[0], axis=1) < _STILL_M
        if near.sum() >= min(_SEEN_AGAIN, len(found)):
            places.append(np.median(every[near], axis=0))
        every = every[~near]
    return np.array(places).reshape(-1, 3)


def _without_still(seen: Sequence[FloatArray]) -> list[FloatArray]:
    """Leave out the points that stand at one place in most windows."""
    every = np.concatenate(seen) if seen else np.empty((0, 3))
    kept = []
    for points in seen:
        near = np.linalg.norm(points[:, None] - every, axis=2) < _STILL_M
        kept.append(points[near.sum(axis=1) < max(3, len(seen) // 2)])
    return kept


def _cross(vector: FloatArray) -> FloatArray:
    """Return -[v]×, by which a small turn moves the point v."""
    return np.cross(np.eye(3), vector)


def _transform(T_a_b: Pose) -> Transform:
    return Transform(T_a_b.position, T_a_b.quaternion_wxyz)


def _vector(values: FloatArray) -> Vector:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
