"""The records within a chunk, found one by one where no index can be believed."""

import struct
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from mcap.opcode import Opcode

from daq.recording.scanning.segments import RECORD
from robot_drivers.protocols import IntArray

# channel, sequence, log time and publish time of a message
MESSAGE_HEAD = struct.Struct("<HIQQ")
_LAST_OPCODE = max(Opcode)


@dataclass(frozen=True, slots=True)
class Walk:
    """Records found one by one: messages, the others with opcode and body, and where the last whole one ends."""

    offsets: dict[int, IntArray]
    log_times: dict[int, IntArray]
    others: list[tuple[int, memoryview]]
    end: int


def walk(records: memoryview) -> Walk:
    """Find the records of a chunk one by one, up to the first that is incomplete or none."""
    offsets: defaultdict[int, list[int]] = defaultdict(list)
    log_times: defaultdict[int, list[int]] = defaultdict(list)
    others: list[tuple[int, memoryview]] = []
    end = 0
    for opcode, start, after in _records(records):
        if opcode == Opcode.MESSAGE:
            head = MESSAGE_HEAD.unpack_from(records, start + RECORD.size)
            offsets[head[0]].append(start)
            log_times[head[0]].append(head[2])
        else:
            others.append((opcode, records[start + RECORD.size : after]))
        end = after
    return Walk(
        {key: np.array(found) for key, found in offsets.items()},
        {key: np.array(found, np.uint64).astype(np.int64) for key, found in log_times.items()},
        others,
        end,
    )


def _records(records: memoryview) -> Iterator[tuple[int, int, int]]:
    """Yield opcode, start and end of each whole record."""
    start = 0
    while start + RECORD.size <= len(records):
        opcode, length = RECORD.unpack_from(records, start)
        end = start + RECORD.size + length
        too_short = opcode == Opcode.MESSAGE and length < MESSAGE_HEAD.size
        if not 0 < opcode <= _LAST_OPCODE or end > len(records) or too_short:
            return
        yield opcode, start, end
        start = end
