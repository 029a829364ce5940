"""What was found in a file and is left out once all of it was seen: repeated chunks, and what no checksum covers."""

from dataclasses import replace

import numpy as np
from mcap.opcode import Opcode
from zlib_ng import zlib_ng

from daq.recording.scanning.chunk_reading import chunk_head
from daq.recording.scanning.records import without_last
from daq.recording.scanning.segments import RECORD, Damage, Scan, Segment


def leave_out_repeated(result: Scan) -> None:
    """Leave out chunks that stand there before with the same records."""
    before: dict[tuple[int, int], Segment] = {}
    kept = []
    for segment in result.segments:
        key = (len(segment.data), _checksum(result, segment))
        first = before.setdefault(key, segment)
        if first is not segment and segment.checked and np.array_equal(_octets(first), _octets(segment)):
            what = f"repeats the chunk at byte {first.start}"
            result.damages.append(Damage(segment.start, segment.end - segment.start, what, repeated=True))
        else:
            kept.append(segment)
    result.segments = kept


def leave_out_unchecked(result: Scan, data_end: int | None) -> None:
    """Leave out what has no checksum where the rest has one, or where that of the whole file disagrees."""
    unchecked = [one for one in result.segments if not one.checked and not _is_cut_off(result, one)]
    if not unchecked:
        return
    data, behind = result.view, 0 if data_end is None else data_end + RECORD.size
    whole = int.from_bytes(data[behind : behind + 4], "little") if behind else 0
    agrees = whole != 0 and zlib_ng.crc32(data[:data_end]) == whole
    if any(one.checked for one in result.segments):
        what = "has no checksum, and the others have"
    elif whole and not agrees:
        what = "has no checksum of its own, and that of the whole file disagrees"
    else:
        _without_neighbours_of_damage(result)
        if agrees:
            result.segments = [replace(one, checked=True) for one in result.segments]
        return
    for segment in unchecked:
        _reject(result, segment, f"what begins at byte {segment.start} {what}")
    rejected = {segment.start for segment in unchecked}
    result.segments = [one for one in result.segments if one.start not in rejected]


def _without_neighbours_of_damage(result: Scan) -> None:
    """Leave out messages without a checksum that damage follows at once: it may begin within them."""
    begins = {damage.start: place for place, damage in enumerate(result.damages)}
    kept = []
    for segment in result.segments:
        place = begins.get(segment.end)
        if place is None or segment.index is not None or _is_cut_off(result, segment):
            kept.append(segment)
            continue
        shorter, start = without_last(segment)
        damage = result.damages[place]
        result.damages[place] = replace(damage, start=start, size=damage.end - start)
        if shorter is not None:
            kept.append(shorter)
    result.segments = kept


def _is_cut_off(result: Scan, segment: Segment) -> bool:
    """Tell whether these are the remains of a chunk that the end of the file cuts off."""
    return segment.index is None and result.view[segment.start] != Opcode.MESSAGE


def _reject(result: Scan, segment: Segment, what: str) -> None:
    result.damages.append(Damage(segment.start, segment.end - segment.start, what))


def _checksum(result: Scan, segment: Segment) -> int:
    return 0 if segment.index is None else chunk_head(result.view, segment.start).checksum


def _octets(segment: Segment) -> np.ndarray[tuple[int], np.dtype[np.uint8]]:
    return np.frombuffer(segment.data, np.uint8)
