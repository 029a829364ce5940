"""The images of a LeRobot dataset as video: a thousandth of the size, and not what the camera saw to the last bit.

Each camera has files of its own, in which the frames of one episode follow those of another; an episode is never
divided. The codec is MPEG-4 Part 2, which the image library at hand writes and every decoder of FFmpeg reads.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from daq.errors import RecordingError

VIDEO_PATH = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
MOST_VIDEO_MB = 200
"""Size of a file, about."""
_CODEC = "mpeg4"
_FOURCC = "mp4v"
_CHUNK_SIZE = 1000


def video_info(shape: tuple[int, ...], fps: int) -> dict[str, Any]:
    """Return what ``meta/info.json`` says of a video whose frames have this shape (height, width, channels)."""
    return {
        "video.height": shape[0],
        "video.width": shape[1],
        "video.codec": _CODEC,
        "video.pix_fmt": "yuv420p",
        "video.is_depth_map": False,
        "video.fps": fps,
        "video.channels": shape[2],
        "has_audio": False,
    }


def even(rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return an image without its last row or column where their number is odd: colours are stored for pairs."""
    height, width = rgb.shape[:2]
    return rgb[: height - height % 2, : width - width % 2]


class Video:
    """The video of one camera; :meth:`begin` each episode, then :meth:`add` its frames."""

    def __init__(self, folder: Path, key: str, fps: int) -> None:
        self._folder, self._key, self._fps = folder, key, fps
        self._writer: cv2.VideoWriter | None = None
        self._path = folder
        self._number = -1
        self._frames = 0

    def begin(self, frames: int) -> Mapping[str, Any]:
        """Begin an episode of so many frames; return what its row says of where they are."""
        if self._writer is not None and self._path.stat().st_size > MOST_VIDEO_MB * 2**20:
            self.close()
        if self._writer is None:
            self._number += 1
            self._frames = 0
        chunk, file = divmod(self._number, _CHUNK_SIZE)
        place = f"videos/{self._key}"
        return {
            f"{place}/chunk_index": chunk,
            f"{place}/file_index": file,
            f"{place}/from_timestamp": self._frames / self._fps,
            f"{place}/to_timestamp": (self._frames + frames) / self._fps,
        }

    def add(self, rgb: NDArray[np.uint8]) -> None:
        """Append a frame (height, width, 3) of even height and width."""
        if self._writer is None:
            self._writer = self._opened(rgb.shape[1], rgb.shape[0])
        self._writer.write(np.ascontiguousarray(rgb[..., ::-1]))
        self._frames += 1

    def close(self) -> None:
        """End the file."""
        if self._writer is not None:
            self._writer.release()
            self._writer = None

    def _opened(self, width: int, height: int) -> cv2.VideoWriter:
        chunk, file = divmod(self._number, _CHUNK_SIZE)
        place = VIDEO_PATH.format(video_key=self._key, chunk_index=chunk, file_index=file)
        self._path = self._folder / place
        self._path.parent.mkdir(parents=True, exist_ok=True)
        codec = cv2.VideoWriter.fourcc(*_FOURCC)
        writer = cv2.VideoWriter(str(self._path), cv2.CAP_FFMPEG, codec, float(self._fps), (width, height))
        if not writer.isOpened():
            raise RecordingError(
                f"{self._path.name}: video of {width} x {height} cannot be written by this build of OpenCV; leave out "
                "--video, which keeps the images without loss"
            )
        return writer
