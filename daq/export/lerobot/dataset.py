"""Writing sessions as a LeRobot dataset v3.0: each session an episode, frames in Parquet, and what describes them.

Layout and columns are those of ``src/lerobot/datasets`` of LeRobot.
"""

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from daq.errors import RecordingError
from daq.export.lerobot.data_files import (
    DataFiles,
    Features,
    columns_of,
    features_of,
    image_key,
    schema_of,
    write_frames,
)
from daq.export.lerobot.description import Episode, write_description
from daq.export.lerobot.frames import frames_of
from daq.export.lerobot.videos import Video
from daq.progress import Progress
from daq.recording.folder import SessionInfo
from daq.recording.reader import Recording


@dataclass(frozen=True, slots=True)
class LerobotDataset:
    """What was written: frames of each episode, their rate, and frames without a sample of the force sensor."""

    frames: dict[str, int]
    fps: int
    between: int


def write_lerobot(
    recordings: Sequence[Recording],
    folder: Path,
    fps: int | None,
    progress: Progress,
    *,
    as_video: bool = False,
) -> LerobotDataset:
    """Write sessions as the episodes of a new dataset.

    Parameters
    ----------
    fps : frames a second; None for the rate of the first session's slowest camera
    as_video : whether images become video, which is small and not without loss

    Raises
    ------
    SynchronisationError, RigError
        A session has no frames.
    RecordingError
        The sessions differ in cameras, in the size of images or in joints.
    """
    (folder / "meta" / "episodes" / "chunk-000").mkdir(parents=True)
    tasks = list(dict.fromkeys(_task(one.info) for one in recordings))
    features: Features = {}
    episodes: list[Episode] = []
    videos: dict[str, Video] = {}
    between = 0
    with ExitStack() as stack:
        files = stack.enter_context(DataFiles(folder))
        for number, recording in enumerate(recordings):
            frames = frames_of(recording, fps)
            fps = frames.fps
            between += frames.between
            own = features_of(frames, as_video=as_video)
            if features and own != features:
                raise RecordingError(
                    f"{recording.folder}: has other cameras, images or joints than {recordings[0].folder}; "
                    "export it into a dataset of its own"
                )
            if as_video and not features:
                videos = {name: Video(folder, image_key(name), frames.fps) for name in frames.cameras}
                for video in videos.values():
                    stack.callback(video.close)
            features = own
            place = files.next(schema_of(features))
            task = _task(recording.info)
            first = episodes[-1].row["dataset_to_index"] if episodes else 0
            columns = columns_of(frames, number, first, tasks.index(task))
            tell = partial(progress, f"writing episode {number + 1} of {len(recordings)}")
            in_videos = [video.begin(len(frames)) for video in videos.values()]
            images = write_frames(files, frames, columns, videos, tell)
            row = {
                "episode_index": number,
                "tasks": [task],
                "length": len(frames),
                "data/chunk_index": place[0],
                "data/file_index": place[1],
                "dataset_from_index": first,
                "dataset_to_index": first + len(frames),
            }
            for told in in_videos:
                row |= told
            episodes.append(Episode(row, columns, images))
    assert fps is not None
    robot = recordings[0].info.devices.get("robot")
    write_description(folder, features, episodes, tasks, (fps, robot.model if robot else ""))
    names = [str(one.folder) for one in recordings]
    counts = {name: one.row["length"] for name, one in zip(names, episodes, strict=True)}
    return LerobotDataset(counts, fps, between)


def _task(info: SessionInfo) -> str:
    """Return what is done in a session, in words."""
    kind = str(info.trajectory.get("kind", "retraction")).replace("_", " ")
    return f"{kind}, phantom {info.phantom_id}"
