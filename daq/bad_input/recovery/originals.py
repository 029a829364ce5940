"""Sessions before they are damaged, with every sample that is in them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from daq.bad_input.samples.sessions import Extent, cut_session, sealed_session
from daq.recording.folder import RECORDED_FILES
from daq.recording.reader import Recording
from daq.recording.scanning.scan import scan

Sample: TypeAlias = tuple[object, ...]
Streams: TypeAlias = dict[str, dict[int, Sample]]
_EXTENT = Extent(samples=180, samples_in_chunk=15, images=5)


@dataclass(frozen=True, slots=True)
class Original:
    """A session before it is damaged.

    Attributes
    ----------
    sealed : whether it was; otherwise its recorder was killed
    files : by their names in the folder
    streams : the samples of each stream by their number
    intact : for each recorded file its chunks, and the samples that each holds
    """

    sealed: bool
    files: Mapping[str, bytes]
    streams: Streams
    intact: Mapping[str, Sequence[tuple[bytes, Streams]]]


def originals(folder: Path) -> list[Original]:
    """Write a session that was cut off and a sealed one into a folder, and keep what is in them."""
    made = []
    for write, name in ((cut_session, "cut"), (sealed_session, "sealed")):
        place = folder / name
        place.mkdir()
        write(place, _EXTENT)
        session = place / "session"
        files = {
            path.relative_to(session).as_posix(): path.read_bytes()
            for path in sorted(session.rglob("*"))
            if path.is_file()
        }
        intact = {name: _chunks_with_samples(session / name) for name in RECORDED_FILES}
        made.append(Original(name == "sealed", files, streams_of(Recording(session)), intact))
    return made


def streams_of(recording: Recording) -> Streams:
    """Return every sample of a recording by its number, as values that can be compared."""
    force, robot = recording.force, recording.robot
    found: Streams = {"force": _by_number(force), "robot": _by_number(robot)}
    for name in recording.cameras:
        images = recording.images(name)
        found[f"camera/{name}"] = {
            number: (
                float(images.device_time_s[place]),
                int(images.host_time_ns[place]),
                images.pixel_format(place),
                images.image(place).tobytes(),
            )
            for place, number in enumerate(images.counter.tolist())
        }
    found["events"] = {
        int(event.details["number"]): (event.time_ns, event.name, str(event.details))
        for event in recording.events
    }
    return found


def _by_number(block: Any) -> dict[int, Sample]:
    columns = [getattr(block, one.name) for one in fields(block) if one.name != "counter"]
    rows = [[row.tobytes() for row in np.asarray(column)] for column in columns]
    numbers = block.counter.tolist()
    return {number: tuple(row) for number, row in zip(numbers, zip(*rows, strict=True), strict=True)}


def _chunks_with_samples(path: Path) -> list[tuple[bytes, Streams]]:
    """Return the bytes of each chunk without its indexes, and the numbers of the samples in it by stream."""
    content = path.read_bytes()
    kept = []
    with scan(path) as found:
        for segment in found.segments:
            index = segment.index
            assert index is not None
            samples: Streams = {}
            for key, channel in found.channels.items():
                stream = stream_name(channel.topic)
                numbers = segment.heads(key)["sequence"].tolist()
                samples.setdefault(stream, {}).update(dict.fromkeys(numbers, ()))
            begin = index.chunk_start_offset
            kept.append((content[begin : begin + index.chunk_length], samples))
    return kept


def stream_name(topic: str) -> str:
    """Return what :func:`streams_of` calls the stream of a topic."""
    parts = topic.strip("/").split("/")
    return "/".join(parts[:2]) if parts[0] == "camera" else parts[0]
