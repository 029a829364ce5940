"""Where reading goes on behind damage: the next chunk whose checksum agrees, or the next run of messages."""

import re
from collections.abc import Iterator

from mcap.opcode import Opcode

from daq.recording.scanning.chunk_reading import UnusableError, chunk_head
from daq.recording.scanning.records import loose_message, read_record
from daq.recording.scanning.segments import RECORD

# Opcode, length, two times, uncompressed size, checksum, compression, size: lengths below a terabyte.
_CHUNK_HEAD = re.compile(
    rb"\x06.{5}\0{3}.{16}.{5}\0{3}.{4}(?:\0{4}|\x03\0{3}lz4|\x04\0{3}zstd).{5}\0{3}", re.DOTALL
)
_HEAD_SIZE = 64
_CHAIN = 3


def next_chunk(data: memoryview, start: int, before: int | None = None) -> int | None:
    """Return where the next chunk begins that can be read, from a place on and before another; None without one."""
    for place in _chunk_heads(data, start, len(data) if before is None else before):
        try:
            read_record(data, place, frozenset())
        except UnusableError:
            continue
        return place
    return None


def next_usable(data: memoryview, start: int, own_end: int | None, limit: int, loose: frozenset[int]) -> int:
    """Return where reading goes on behind what cannot be used; ``limit`` where nothing more is found before it.

    Parameters
    ----------
    start : of what cannot be used
    own_end : where it ends by its own account, None where that cannot be
    limit : where the data end
    loose : the channels whose messages may lie outside of chunks
    """
    chunk = next_chunk(data[:limit], start + 1)
    found = limit if chunk is None else chunk
    if (
        own_end is not None
        and start < (end := _behind_indexes(data, own_end)) < found
        and _usable(data, end, loose)
    ):
        return end
    if loose and not _is_chunk(data, start):
        found = next((place for place in _chains(data[:found], start + 1, loose)), found)
    return found


def _chunk_heads(data: memoryview, start: int, before: int) -> Iterator[int]:
    while (found := _CHUNK_HEAD.search(data, start, min(before + _HEAD_SIZE, len(data)))) is not None:
        if found.start() >= before:
            return
        yield found.start()
        start = found.start() + 1


def _is_chunk(data: memoryview, place: int) -> bool:
    """Tell whether a chunk begins at a place, even one that cannot be read; messages in it are not loose."""
    try:
        return data[place] == Opcode.CHUNK and bool(chunk_head(data, place))
    except UnusableError:
        return False


def _behind_indexes(data: memoryview, place: int) -> int:
    """Pass over the message indexes of a chunk that cannot be used."""
    while place + RECORD.size <= len(data):
        opcode, length = RECORD.unpack_from(data, place)
        end = place + RECORD.size + length
        if opcode != Opcode.MESSAGE_INDEX or end > len(data):
            break
        place = end
    return place


def _usable(data: memoryview, place: int, loose: frozenset[int]) -> bool:
    try:
        read_record(data, place, loose)
    except UnusableError:
        return False
    return True


def _chains(data: memoryview, start: int, loose: frozenset[int]) -> Iterator[int]:
    """Yield where some messages outside of chunks follow one another, or one ends where the data do."""
    content = bytes(data[start:])
    place = content.find(Opcode.MESSAGE)
    while place >= 0:
        end, length = start + place, 0
        while length < _CHAIN and (head := loose_message(data, end, loose)) is not None:
            end, length = head[2], length + 1
        if length == _CHAIN or (length and end == len(data)):
            yield start + place
        place = content.find(Opcode.MESSAGE, place + 1)
