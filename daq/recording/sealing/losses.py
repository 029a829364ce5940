"""How many samples of each stream damage has cost, from the numbers that the recorder gave them.

Every sample carries its place in its stream. Where samples of a stream follow damage, the numbers on both sides tell
exactly what is missing between. Behind the last sample nothing does, unless the session or the summary of the file says
how many there were; then the number is estimated from the share that the stream has in the bytes of the file.
"""

import json
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from daq.recording.layout import EVENTS
from daq.recording.messages.rows import RECORD
from daq.recording.scanning.segments import Damage, Scan
from robot_drivers.protocols import IntArray

_CAMERA = re.compile(r"/camera/(?P<name>[^/]+(/depth)?)/(image|image_raw|device)")
_SINGLE = {
    "/force/wrench": "force",
    "/force/device": "force",
    "/robot/pose": "robot",
    "/robot/joints": "robot",
    "/robot/device": "robot",
    "/events": "events",
}


@dataclass(frozen=True, slots=True)
class StreamLoss:
    """Samples of a stream that are missing; ``estimated`` where nothing tells how many there were in the end."""

    samples: int
    estimated: bool

    def __str__(self) -> str:
        return f"about {self.samples}" if self.estimated else f"{self.samples}"


def stream_of(topic: str) -> str:
    """Return the stream that a topic belongs to: ``force``, ``robot``, ``camera/<name>``, or the topic's own name."""
    camera = _CAMERA.fullmatch(topic)
    return f"camera/{camera['name']}" if camera else _SINGLE.get(topic, topic.lstrip("/"))


def samples_by_stream(counts: Mapping[str, int]) -> dict[str, int]:
    """Return the samples of each stream, given the messages of each topic; images may be on two."""
    found: defaultdict[str, list[int]] = defaultdict(list)
    for topic, count in counts.items():
        if not topic.endswith("/image_raw"):
            raw = counts.get(f"{topic}_raw", 0) if topic.endswith("/image") else 0
            found[stream_of(topic)].append(count + raw)
    return {stream: min(each) for stream, each in found.items()}


def losses(found: Scan, told: Mapping[str, int]) -> dict[str, StreamLoss]:
    """Return what each stream has lost; streams that have lost nothing are left out.

    Parameters
    ----------
    told : messages of each topic before the damage, as the session tells; empty where it does not
    """
    told_by_file = {} if found.told_counts is None else _by_topic(found, found.told_counts)
    before = samples_by_stream(told or told_by_file)
    numbers = dict(_numbers(found))
    dropped = _dropped_by_recorder(found)
    lost = {}
    for stream in sorted({*numbers, *before}):
        places, starts = numbers.get(stream, _NOTHING)
        if stream in before:
            loss = StreamLoss(max(0, before[stream] - len(places)), estimated=False)
        else:
            loss = _by_numbers(found, places, starts, dropped.get(stream, 0))
        if loss.samples or loss.estimated:
            lost[stream] = loss
    return lost


_NOTHING: tuple[IntArray, IntArray] = (np.empty(0, np.int64), np.empty(0, np.int64))


def _by_topic(found: Scan, counts: Mapping[int, int]) -> dict[str, int]:
    sums: defaultdict[str, int] = defaultdict(int)
    for key, channel in found.channels.items():
        sums[channel.topic] += counts.get(key, 0)
    return sums


def _numbers(found: Scan) -> Iterator[tuple[str, tuple[IntArray, IntArray]]]:
    """Yield for each stream the numbers of its whole samples, ascending, and where the segment of each begins."""
    topics: defaultdict[str, list[str]] = defaultdict(list)
    for channel in found.channels.values():
        if channel.topic not in topics[stream_of(channel.topic)]:
            topics[stream_of(channel.topic)].append(channel.topic)
    for stream, members in topics.items():
        parts: defaultdict[str, list[tuple[IntArray, IntArray]]] = defaultdict(list)
        for topic in members:
            for key in found.channel_ids(topic):
                for segment in found.segments:
                    if len(heads := segment.heads(key)):
                        numbers = heads["sequence"].astype(np.int64)
                        # an image is on either of two topics
                        part = topic.removesuffix("_raw")
                        parts[part].append((numbers, np.full(len(numbers), segment.start)))
        named = {topic.removesuffix("_raw") for topic in members}
        if parts.keys() == named:
            yield stream, _whole(list(parts.values()))
        else:
            yield stream, _NOTHING


def _whole(parts: Sequence[Sequence[tuple[IntArray, IntArray]]]) -> tuple[IntArray, IntArray]:
    """Return the numbers that every part of a sample has, and where the segment of the first part begins.

    Samples that another program has written again without their numbers are counted from zero.
    """
    if not any(one.any() for part in parts for one, _ in part):
        count = min(sum(len(one) for one, _ in part) for part in parts)
        return np.arange(count), np.concatenate([start for _, start in parts[0]])[:count]
    numbers, first = np.unique(np.concatenate([one for one, _ in parts[0]]), return_index=True)
    starts = np.concatenate([start for _, start in parts[0]])[first]
    for part in parts[1:]:
        kept = np.isin(numbers, np.concatenate([one for one, _ in part]))
        numbers, starts = numbers[kept], starts[kept]
    return numbers, starts


def _dropped_by_recorder(found: Scan) -> dict[str, int]:
    """Return the samples of each stream that a recorder had no room for, as its last event about them tells."""
    dropped: dict[str, int] = {}
    for record in found.records(EVENTS):
        body = bytes(record[RECORD.itemsize :])
        if b"samples_dropped" in body:
            told = json.loads(body).get("samples", {})
            dropped |= {stream: max(count, dropped.get(stream, 0)) for stream, count in told.items()}
    return dropped


def _by_numbers(found: Scan, numbers: IntArray, starts: IntArray, dropped: int) -> StreamLoss:
    """Return what is missing before and between the samples that there are, and about how many behind them.

    What is missing without damage around it was ``dropped`` by the recorder, or is lost with a whole chunk.
    """
    damages = [damage for damage in found.damages if not damage.repeated]
    if not len(numbers):
        return StreamLoss(0, estimated=bool(damages))
    missing = elsewhere = 0
    before_numbers = np.concatenate([[-1], numbers[:-1]])
    before_starts = np.concatenate([[0], starts[:-1]])
    for place in np.nonzero(numbers - before_numbers > 1)[0].tolist():
        begin, end = sorted((int(before_starts[place]), int(starts[place])))
        gap = int(numbers[place] - before_numbers[place]) - 1
        if any(begin <= damage.start <= end for damage in damages):
            missing += gap
        else:
            elsewhere += gap
    missing += max(0, elsewhere - dropped)
    behind = [damage for damage in damages if damage.start >= int(starts.max())]
    if not behind:
        return StreamLoss(missing, estimated=False)
    return StreamLoss(missing + _share(found, len(numbers), behind), estimated=True)


def _share(found: Scan, samples: int, behind: Sequence[Damage]) -> int:
    """Return about how many samples of a stream are in damage, by its share of the bytes that can be read."""
    usable = sum(segment.end - segment.start for segment in found.segments)
    damaged = sum(damage.size + damage.missing for damage in behind if damage.what != "zeros")
    return round(samples * damaged / usable) if usable else 0
