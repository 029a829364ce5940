"""The frames of a LeRobot dataset in Parquet: what each column is, and the files that hold them.

Images are kept without loss, as PNG within Parquet (``dtype`` ``image``), so that beads can still be measured in them;
or as video beside it (``dtype`` ``video``), where their size matters more.
"""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeAlias

import cv2
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from daq.export.lerobot.frames import POSE, WRENCH, Frames
from daq.export.lerobot.statistics import MOST_IMAGES, ImageStatistics
from daq.export.lerobot.videos import Video, even, video_info

Features: TypeAlias = dict[str, dict[str, Any]]
Columns: TypeAlias = dict[str, NDArray[Any]]

CHUNK_SIZE = 1000
"""Files in a folder."""
MOST_DATA_MB = 100
"""Size of a file, about; an episode is never divided."""
FILE = "chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
DATA_PATH = f"data/{FILE}"

_BATCH = 32  # frames in memory
_IMAGE = pa.struct([("bytes", pa.binary()), ("path", pa.string())])
_INDICES = ("frame_index", "episode_index", "index", "task_index")


class DataFiles:
    """The files of frames: an episode begins a new one where the last has become large enough."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._writer: pq.ParquetWriter | None = None
        self._number = -1
        self._path = folder

    def __enter__(self) -> "DataFiles":
        return self

    def __exit__(self, *_: object) -> None:
        if self._writer is not None:
            self._writer.close()

    def next(self, schema: pa.Schema) -> tuple[int, int]:
        """Return folder and number of the file for the next episode."""
        if self._writer is None or self._path.stat().st_size > MOST_DATA_MB * 2**20:
            if self._writer is not None:
                self._writer.close()
            self._number += 1
            chunk, file = divmod(self._number, CHUNK_SIZE)
            self._path = self._folder / DATA_PATH.format(chunk_index=chunk, file_index=file)
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._writer = pq.ParquetWriter(self._path, schema)
        return divmod(self._number, CHUNK_SIZE)

    def write(self, table: pa.Table) -> None:
        """Append frames to the file of the episode."""
        assert self._writer is not None
        self._writer.write_table(table)


def image_key(camera: str) -> str:
    """Return the name of a camera's column."""
    return f"observation.images.{camera}"


def features_of(frames: Frames, *, as_video: bool) -> Features:
    """Return what each column is, in the words of ``meta/info.json``."""
    joints = [f"joint_{number}" for number in range(1, frames.joints.shape[1] + 1)]
    vectors = {
        "observation.state": list(POSE),
        "observation.joints": joints,
        "observation.wrench": list(WRENCH),
        "action": list(POSE),
    }
    found: Features = {
        name: {"dtype": "float32", "shape": [len(names)], "names": names} for name, names in vectors.items()
    }
    for name, camera in frames.cameras.items():
        first = camera.rgb(0)
        shape = (even(first) if as_video else first).shape
        named: dict[str, Any] = {"shape": list(shape), "names": ["height", "width", "channels"]}
        kind = {"dtype": "video", "info": video_info(shape, frames.fps)} if as_video else {"dtype": "image"}
        found[image_key(name)] = kind | named
    found["timestamp"] = {"dtype": "float32", "shape": [1], "names": None}
    return found | {name: {"dtype": "int64", "shape": [1], "names": None} for name in _INDICES}


def columns_of(frames: Frames, episode: int, first: int, task: int) -> Columns:
    """Return the columns of an episode but for its images."""
    number = np.arange(len(frames))
    return {
        "observation.state": frames.pose.astype(np.float32),
        "observation.joints": frames.joints.astype(np.float32),
        "observation.wrench": frames.wrench.astype(np.float32),
        "action": frames.action.astype(np.float32),
        "timestamp": (number / frames.fps).astype(np.float32),
        "frame_index": number,
        "episode_index": np.full(len(frames), episode),
        "index": first + number,
        "task_index": np.full(len(frames), task),
    }


def schema_of(features: Features) -> pa.Schema:
    """Return the types of the columns in Parquet, and what the library ``datasets`` asks for to show images."""
    fields: list[Any] = []
    told: dict[str, Any] = {}
    for name, feature in features.items():
        kind, size = feature["dtype"], feature["shape"][0]
        value: dict[str, Any] = {"dtype": kind, "_type": "Value"}
        if kind == "video":
            continue  # beside the Parquet files
        if kind == "image":
            fields.append(pa.field(name, _IMAGE))
            told[name] = {"_type": "Image"}
        elif size == 1:
            fields.append(pa.field(name, pa.type_for_alias(kind)))
            told[name] = value
        else:
            fields.append(pa.field(name, pa.list_(pa.type_for_alias(kind), size)))
            told[name] = {"feature": value, "length": size, "_type": "Sequence"}
    return pa.schema(fields, metadata={"huggingface": json.dumps({"info": {"features": told}})})


def write_frames(
    files: DataFiles,
    frames: Frames,
    columns: Columns,
    videos: Mapping[str, Video],
    progress: Callable[[int, int], None],
) -> dict[str, ImageStatistics]:
    """Write the frames of an episode in batches; return what values its images have.

    Parameters
    ----------
    videos : of each camera, with the episode begun; empty where images go into Parquet
    """
    schema = schema_of(features_of(frames, as_video=bool(videos)))
    found = {name: ImageStatistics() for name in frames.cameras}
    counted = set(np.linspace(0, len(frames) - 1, min(len(frames), MOST_IMAGES)).astype(int).tolist())
    for begin in range(0, len(frames), _BATCH):
        progress(begin, len(frames))
        rows = range(begin, min(begin + _BATCH, len(frames)))
        arrays = {name: _array(values[rows.start : rows.stop]) for name, values in columns.items()}
        for name, camera in frames.cameras.items():
            cells = []
            for row in rows:
                rgb = even(camera.rgb(row)) if videos else camera.rgb(row)
                if row in counted:
                    found[name].add(rgb)
                if videos:
                    videos[name].add(rgb)
                else:
                    cells.append({"bytes": _png(rgb), "path": f"frame-{row:06d}.png"})
            arrays[image_key(name)] = pa.array(cells, _IMAGE)
        files.write(pa.table([arrays[name] for name in schema.names], schema=schema))
    return found


def _array(values: NDArray[Any]) -> pa.Array:
    if values.ndim == 1:
        return pa.array(values)
    return pa.FixedSizeListArray.from_arrays(pa.array(values.ravel()), values.shape[1])


def _png(rgb: NDArray[np.uint8]) -> bytes:
    return cv2.imencode(".png", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR))[1].tobytes()
