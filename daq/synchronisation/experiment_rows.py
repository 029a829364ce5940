"""From a recording to an experiment: one row for every measuring window, in the tissue frame.

Every stream is put on the host clock by the lower envelope of its own clock, and averaged over the windows that the
session's events tell. Nothing is interpolated: a window in which a stream has too few samples gives empty fields.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from daq.errors import SynchronisationError
from daq.frames import inverse, quaternions_wxyz, rotation
from daq.progress import Progress
from daq.recording.folder import RIG_FILE, SessionInfo
from daq.recording.reader import Recording
from daq.rig import Frames, Rig, read_rig
from daq.synchronisation.fiducial_windows import FiducialMeans, fiducial_means
from daq.synchronisation.stream_times import force_times, robot_times
from daq.synchronisation.windows import Means, Window, in_window, measuring_windows, window_means
from daq.synchronisation.wrenches import WrenchCompensation
from daq.timing.event_times import EventTimes
from daq.trajectories import experiment_kind
from estimator.experiment import Experiment, SensorNoise
from robot_drivers.protocols import FloatArray, PoseBlock, WrenchBlock

_OF_NO_BEAD_M = 1e-5  # an experiment states some noise of beads, also without any


@dataclass(frozen=True, slots=True)
class Synchronised:
    """An experiment, and how its streams came together.

    Attributes
    ----------
    windows : in which its rows were measured
    times : of each stream, on the host clock
    samples : how many samples of each stream every row holds
    rejected : what the cameras saw and vision did not use, by stage and reason
    """

    experiment: Experiment
    windows: tuple[Window, ...]
    times: dict[str, EventTimes]
    samples: dict[str, tuple[int, ...]]
    rejected: Mapping[str, int]


def synchronise(recording: Recording, progress: Progress, most_pairs_per_s: float = math.inf) -> Synchronised:
    """Turn a recording into an experiment.

    Parameters
    ----------
    most_pairs_per_s : of images that are looked at in a window, about; the beads' means are the coarser for fewer

    Raises
    ------
    SynchronisationError
        There is no window at rest, a stream is missing from it, so that nothing can be zeroed, or the robot's poses
        are missing from any window.
    """
    rig = read_rig(recording.folder / RIG_FILE, to_connect=False)
    windows = measuring_windows(recording.events)
    progress("averaging force and pose", 0, 1)
    signals = signal_means(recording.force, recording.robot, rig, windows)
    beads = fiducial_means(recording, rig, windows, progress, most_pairs_per_s)
    return brought_together(recording.info, rig, windows, signals, beads)


@dataclass(frozen=True, slots=True)
class SignalMeans:
    """Force and pose in every window.

    Attributes
    ----------
    taken, stood : times of the force sensor and of the robot
    positions : (n, 3) of the gripper, tissue frame, m
    orientations : (n, 4) of the gripper in the tissue frame
    wrenches : (n, 6) of the tissue on the gripper, zero at rest, N and N·m
    """

    taken: EventTimes
    stood: EventTimes
    positions: Means
    orientations: FloatArray
    wrenches: Means


def signal_means(force: WrenchBlock, robot: PoseBlock, rig: Rig, windows: Sequence[Window]) -> SignalMeans:
    """Average force and pose over windows, the first of them at rest.

    Raises
    ------
    SynchronisationError
        Force or pose is missing at rest, or the poses from any window.
    """
    taken, stood = force_times(force, rig), robot_times(robot)
    position, quaternion = gripper_in_tissue(robot, rig.frames)
    positions = window_means(position, stood, windows, "robot")
    orientations = _mean_orientations(quaternion, stood, windows)
    wrenches = _wrench_means(force, taken, windows, orientations, rig)
    return SignalMeans(taken, stood, positions, orientations, wrenches)


def brought_together(
    info: SessionInfo, rig: Rig, windows: Sequence[Window], signals: SignalMeans, fiducials: FiducialMeans
) -> Synchronised:
    """Return the experiment whose rows are the windows."""
    positions, wrenches, beads = signals.positions, signals.wrenches, fiducials.means
    since_rest = rotation(signals.orientations) * rotation(signals.orientations[0]).inv()
    experiment = Experiment(
        name=info.name,
        phantom_id=info.phantom_id,
        order=info.order,
        phantom=rig.specimen.phantom,
        anchors=rig.specimen.anchors,
        grasp=rig.specimen.grasp,
        rollers=rig.specimen.rollers,
        trajectory_kind=experiment_kind(info.trajectory["kind"]),
        environment=rig.specimen.environment,
        sensor=_noise(rig, positions, wrenches, beads),
        fiducials_rest=_rest(rig, beads),
        time=np.array([window.middle_ns - windows[0].middle_ns for window in windows]) * 1e-9,
        phase=tuple(window.phase for window in windows),
        step=np.array([window.number for window in windows], dtype=np.int64),
        position=positions.mean,
        quaternion_wxyz=quaternions_wxyz(since_rest),
        wrench=wrenches.mean,
        fiducials=beads.mean,
    )
    return Synchronised(
        experiment,
        windows=tuple(windows),
        times={"force sensor": signals.taken, "robot": signals.stood, **fiducials.times},
        samples={
            "force sensor": wrenches.count,
            "robot": positions.count,
            **dict.fromkeys(fiducials.times, beads.count),
        },
        rejected=fiducials.rejected,
    )


def gripper_in_tissue(robot: PoseBlock, frames: Frames) -> tuple[FloatArray, FloatArray]:
    """Return position (n, 3) and orientation (n, 4) of the gripper in the tissue frame for every robot state."""
    T_tissue_base = inverse(frames.T_base_tissue.pose)
    T_tool_gripper = frames.T_tool_gripper.pose
    R_tissue_base = rotation(T_tissue_base.quaternion_wxyz)
    R_base_tool = rotation(robot.quaternion_wxyz)
    in_base = robot.position + R_base_tool.apply(T_tool_gripper.position)
    position = R_tissue_base.apply(in_base) + np.asarray(T_tissue_base.position)
    return position, quaternions_wxyz(R_tissue_base * R_base_tool * rotation(T_tool_gripper.quaternion_wxyz))


def _wrench_means(
    force: WrenchBlock, times: EventTimes, windows: Sequence[Window], orientations: FloatArray, rig: Rig
) -> Means:
    """Return the wrench of the tissue on the gripper, tissue axes, zero at rest."""
    readings = np.where(force.usable[:, None], force.wrench, np.nan)
    compensation = WrenchCompensation(
        window_means(readings, times, windows[:1], "force sensor").mean[0],
        orientations[0],
        rig.frames.T_gripper_sensor.pose,
        rig.tool,
        rig.specimen.environment.gravity,
    )
    tissue = np.full_like(readings, np.nan)
    for window, orientation in zip(windows, orientations, strict=True):
        inside = in_window(times, window)
        tissue[inside] = compensation.tissue_wrench(readings[inside], orientation)
    return window_means(tissue, times, windows, "force sensor")


def _mean_orientations(quaternion: FloatArray, times: EventTimes, windows: Sequence[Window]) -> FloatArray:
    """Return the mean orientation (n, 4) of every window; the gripper stands still in it."""
    found = []
    for window in windows:
        inside = quaternion[in_window(times, window)]
        if len(inside) == 0:
            raise SynchronisationError(
                f"step {window.number}: the robot told no pose while it was measured; record the retraction again"
            )
        found.append(quaternions_wxyz(rotation(inside).mean()))
    return np.array(found)


def _noise(rig: Rig, positions: Means, wrenches: Means, beads: Means) -> SensorNoise:
    """Return the noise of one value in one row: the scatter of the means, and what does not show in it."""
    extra = rig.uncertainty
    fiducial_std = _fiducial_std(beads, extra.fiducial_m)
    return SensorNoise(
        force_std=math.hypot(wrenches.pooled_scatter(0, 1, 2), extra.force_n),
        torque_std=math.hypot(wrenches.pooled_scatter(3, 4, 5), extra.torque_nm),
        fiducial_std=fiducial_std,
        position_std=math.hypot(positions.pooled_scatter(), extra.position_m),
        tool_mass=rig.tool.mass_kg,
        tool_centre=rig.tool.centre_m,
        by_channel=_by_channel(rig, beads, fiducial_std),
    )


def _rest(rig: Rig, beads: Means) -> FloatArray:
    """Return where the beads rest, (m, 3), m: as measured, and at the design's height where that was not measured."""
    rest = beads.mean[0]
    if rig.planar_view is None or not len(rest):
        return rest
    design = np.asarray(rig.specimen.fiducials_m)
    return np.where(np.isfinite(rest), rest, design)


def _by_channel(rig: Rig, beads: Means, fiducial_std: float) -> dict[str, float]:
    """Return the noise of single channels, in which the only camera of a rig differs.

    Without depth the uncertain height of the beads makes that of the other two coordinates. With depth each has a
    scatter of its own, and depth may be off.
    """
    if rig.only_view is None or not beads.mean.size:
        return {}
    if rig.depth_view is None:
        return rig.only_view.noise_by_axis(_rest(rig, beads), fiducial_std)
    by_axis = [math.hypot(beads.pooled_scatter(axis), rig.uncertainty.fiducial_m) for axis in range(3)]
    return rig.depth_view.noise_by_axis(_rest(rig, beads), by_axis)


def _fiducial_std(beads: Means, extra_m: float) -> float:
    """Return the noise of a bead's coordinate, m; where there are no beads, any that is one."""
    return math.hypot(beads.pooled_scatter(), extra_m) if beads.mean.size else extra_m or _OF_NO_BEAD_M
