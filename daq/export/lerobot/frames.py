"""A session as frames at a constant rate: gripper, joints, wrench and images at the same instants of the host clock.

The streams are put on the host clock as for an experiment (:mod:`daq.synchronisation.stream_times`). Poses are read
between their samples, a wrench is the mean of a frame's period, an image is the one that was exposed nearest.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from daq.errors import SynchronisationError
from daq.frames import quaternions_wxyz, rotation
from daq.recording.folder import RIG_FILE
from daq.recording.reader import Recording
from daq.recording.stored_streams import Images
from daq.rig import read_rig
from daq.synchronisation.experiment_rows import gripper_in_tissue
from daq.synchronisation.stream_times import exposure_times, force_times, robot_times
from robot_drivers.protocols import FloatArray, IntArray

POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")
WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
DEFAULT_FPS = 30
_FEWEST = 2
_BAYER = {
    "bayer_rggb8": cv2.COLOR_BayerBG2RGB,
    "bayer_bggr8": cv2.COLOR_BayerRG2RGB,
    "bayer_grbg8": cv2.COLOR_BayerGB2RGB,
    "bayer_gbrg8": cv2.COLOR_BayerGR2RGB,
}


@dataclass(frozen=True, slots=True)
class FrameImages:
    """The image of one camera in each frame (n,), by its number in the stream, decoded when it is asked for."""

    images: Images
    numbers: IntArray

    def rgb(self, frame: int) -> NDArray[np.uint8]:
        """Return the image of a frame, (height, width, 3); a grey one has its value in each channel."""
        number = int(self.numbers[frame])
        pixels, kind = self.images.image(number), self.images.pixel_format(number)
        if kind in _BAYER:
            return np.asarray(cv2.cvtColor(pixels, _BAYER[kind]), np.uint8)
        code = cv2.COLOR_GRAY2RGB if pixels.ndim == 2 else cv2.COLOR_BGR2RGB
        return np.asarray(cv2.cvtColor(pixels, code), np.uint8)


@dataclass(frozen=True, slots=True, eq=False)
class Frames:
    """Frames of one session.

    Attributes
    ----------
    fps : frames a second
    pose : (n, 7) of the gripper in the tissue frame: place, m, and quaternion, w first
    joints : (n, j) rad
    wrench : (n, 6) as the sensor reads it, in its frame, N and N·m
    between : frames without a sample of the force sensor of their own, whose wrench is read between neighbours
    cameras : by name
    """

    fps: int
    pose: FloatArray
    joints: FloatArray
    wrench: FloatArray
    between: int
    cameras: Mapping[str, FrameImages]

    def __len__(self) -> int:
        return len(self.pose)

    @property
    def action(self) -> FloatArray:
        """The pose of the frame that comes next, (n, 7); of the last its own."""
        return np.concatenate([self.pose[1:], self.pose[-1:]])


def frames_of(recording: Recording, fps: int | None) -> Frames:
    """Return a session at a constant rate, from when all its streams have begun until the first of them ends.

    Parameters
    ----------
    fps : frames a second; None for that of the slowest camera, rounded, 30 where there is none

    Raises
    ------
    SynchronisationError
        A stream has fewer than two samples, or they are not there at the same time.
    RigError
        The session's rig file cannot be read.
    """
    rig = read_rig(recording.folder / RIG_FILE, to_connect=False)
    force, robot = recording.force, recording.robot
    taken, stood = force_times(force, rig), robot_times(robot)
    images = {name: recording.images(name) for name in recording.cameras}
    exposed = {name: exposure_times(one, rig) for name, one in images.items() if len(one) >= _FEWEST}
    slowest = max((times.period_s for times in exposed.values()), default=1 / DEFAULT_FPS)
    rate = fps or max(round(1 / slowest), 1)
    time_ns = _instants([taken.time_ns, stood.time_ns, *(one.time_ns for one in exposed.values())], rate)
    usable = force.usable & np.isfinite(force.wrench).all(axis=1)
    wrench, between = _means(taken.time_ns[usable], force.wrench[usable], time_ns, rate)
    position, quaternion = gripper_in_tissue(robot, rig.frames)
    return Frames(
        rate,
        pose=np.hstack(
            [_between(stood.time_ns, position, time_ns), _turned(stood.time_ns, quaternion, time_ns)]
        ),
        joints=_between(stood.time_ns, robot.joints, time_ns),
        wrench=wrench,
        between=between,
        cameras={
            name: FrameImages(images[name], _nearest(times.time_ns, time_ns))
            for name, times in exposed.items()
        },
    )


def _instants(streams: list[IntArray], fps: int) -> IntArray:
    begin, end = max(int(one.min()) for one in streams), min(int(one.max()) for one in streams)
    count = int((end - begin) * 1e-9 * fps) + 1
    if end < begin or count < _FEWEST:
        raise SynchronisationError(
            f"force, robot and cameras are there together for {(end - begin) * 1e-9:.2f} s; record for longer"
        )
    return begin + np.rint(np.arange(count) * (1e9 / fps)).astype(np.int64)


def _ascending(time_ns: IntArray, origin_ns: int) -> tuple[FloatArray, IntArray]:
    """Return times in s that ascend, and the places of their samples."""
    unique, first = np.unique(time_ns, return_index=True)
    return np.asarray((unique - origin_ns) * 1e-9, np.float64), first.astype(np.int64)


def _between(time_ns: IntArray, values: FloatArray, wanted_ns: IntArray) -> FloatArray:
    """Return values (n, ...) between their samples, on a straight line."""
    seconds, place = _ascending(time_ns, int(wanted_ns[0]))
    wanted = (wanted_ns - wanted_ns[0]) * 1e-9
    return np.stack([np.interp(wanted, seconds, column) for column in values[place].T], axis=1)


def _turned(time_ns: IntArray, quaternion_wxyz: FloatArray, wanted_ns: IntArray) -> FloatArray:
    """Return orientations (n, 4) between their samples, by the shortest turn, without leaps of their sign."""
    seconds, place = _ascending(time_ns, int(wanted_ns[0]))
    wanted = np.clip((wanted_ns - wanted_ns[0]) * 1e-9, seconds[0], seconds[-1])
    turns: Rotation = Slerp(seconds, rotation(quaternion_wxyz[place]))(wanted)
    found = quaternions_wxyz(turns)
    signs = np.cumprod(np.where(np.sum(found[1:] * found[:-1], axis=1) < 0, -1.0, 1.0))
    return np.asarray(found * np.concatenate([[1.0], signs])[:, None])


def _means(time_ns: IntArray, values: FloatArray, wanted_ns: IntArray, fps: int) -> tuple[FloatArray, int]:
    """Return means (n, k) over the period around each instant, and how many of them had no sample."""
    if len(time_ns) < _FEWEST:
        raise SynchronisationError("the force sensor has no two samples that may be used; record for longer")
    edges = np.concatenate([wanted_ns, wanted_ns[-1:] + round(1e9 / fps)]) - round(0.5e9 / fps)
    place = np.searchsorted(edges, time_ns, side="right") - 1
    inside = (place >= 0) & (place < len(wanted_ns))
    count = np.bincount(place[inside], minlength=len(wanted_ns))
    sums = np.stack(
        [np.bincount(place[inside], weights=column[inside], minlength=len(wanted_ns)) for column in values.T],
        axis=1,
    )
    empty = count == 0
    means = sums / np.maximum(count, 1)[:, None]
    means[empty] = _between(time_ns, values, wanted_ns)[empty]
    return means, int(empty.sum())


def _nearest(time_ns: IntArray, wanted_ns: IntArray) -> IntArray:
    """Return the number of the sample nearest to each instant."""
    order = np.argsort(time_ns, kind="stable")
    ordered = time_ns[order]
    after = np.clip(np.searchsorted(ordered, wanted_ns), 1, len(ordered) - 1)
    before_is_nearer = wanted_ns - ordered[after - 1] <= ordered[after] - wanted_ns
    return np.asarray(order[np.where(before_is_nearer, after - 1, after)], np.int64)
