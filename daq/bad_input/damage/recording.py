"""Damage that befalls recordings: blocks overwritten, missing, put in, repeated, exchanged, at any place of a file."""

import struct
from collections.abc import Sequence
from random import Random

from mcap.opcode import Opcode

from daq.bad_input.damage.any_file import Damage, cut_short, emptied, with_rubbish_behind, zeroed

_LONGEST = 6000


def _place(random: Random, content: bytes) -> tuple[int, int]:
    """Return the begin and the end of a stretch, mostly a short one."""
    begin = random.randrange(len(content))
    length = min(
        random.choice((1, 4, 8, 40, 200, 512, 4096, random.randrange(1, _LONGEST))), len(content) - begin
    )
    return begin, begin + length


def block_overwritten(random: Random, content: bytes) -> bytes:
    """A block is rubbish."""
    begin, end = _place(random, content)
    return content[:begin] + random.randbytes(end - begin) + content[end:]


def bit_flipped(random: Random, content: bytes) -> bytes:
    """A bit is the other one."""
    place = random.randrange(len(content))
    return content[:place] + bytes([content[place] ^ (1 << random.randrange(8))]) + content[place + 1 :]


def block_missing(random: Random, content: bytes) -> bytes:
    """A block is not there, and what follows has moved up."""
    begin, end = _place(random, content)
    return content[:begin] + content[end:]


def block_put_in(random: Random, content: bytes) -> bytes:
    """A block of rubbish lies in between."""
    begin, end = _place(random, content)
    return content[:begin] + random.randbytes(end - begin) + content[begin:]


def block_of_zeros(random: Random, content: bytes) -> bytes:
    """A block is zero, as a page that never reached the disk."""
    begin, end = _place(random, content)
    return content[:begin] + bytes(end - begin) + content[end:]


def block_repeated(random: Random, content: bytes) -> bytes:
    """A block stands there twice."""
    begin, end = _place(random, content)
    return content[:end] + content[begin:]


def block_from_elsewhere(random: Random, content: bytes) -> bytes:
    """A block of the same file lies over another, as where a file system has mixed up its tables."""
    begin, end = _place(random, content)
    source = random.randrange(len(content) - (end - begin) + 1)
    return content[:begin] + content[source : source + end - begin] + content[end:]


def several_overwritten(random: Random, content: bytes) -> bytes:
    """Some blocks are rubbish."""
    for _ in range(random.randrange(2, 6)):
        content = block_overwritten(random, content)
    return content


def zeros_behind(random: Random, content: bytes) -> bytes:
    """Zeros follow, as of a file that had grown when the power went."""
    return content + bytes(random.choice((1, 8, 512, 4096)))


def chunks(content: bytes) -> list[tuple[int, int]]:
    """Return where the chunks of an undamaged file begin and end, each with its message indexes."""
    found: list[tuple[int, int]] = []
    place = 8
    while place + 9 <= len(content) - 8:
        opcode, length = struct.unpack_from("<BQ", content, place)
        end = place + 9 + length
        if opcode == Opcode.CHUNK:
            found.append((place, end))
        elif opcode == Opcode.MESSAGE_INDEX and found:
            found[-1] = (found[-1][0], end)
        place = end
    return found


def chunks_exchanged(random: Random, content: bytes) -> bytes:
    """Two chunks have changed places."""
    places = chunks(content)
    if len(places) < 2:
        return bit_flipped(random, content)
    (a, b), (c, d) = sorted(random.sample(places, 2))
    return content[:a] + content[c:d] + content[b:c] + content[a:b] + content[d:]


def chunk_repeated(random: Random, content: bytes) -> bytes:
    """A chunk stands there twice."""
    places = chunks(content)
    if not places:
        return bit_flipped(random, content)
    begin, end = random.choice(places)
    behind = random.choice(places)[1]
    return content[:behind] + content[begin:end] + content[behind:]


def chunk_missing(random: Random, content: bytes) -> bytes:
    """A whole chunk is not there."""
    places = chunks(content)
    if not places:
        return bit_flipped(random, content)
    begin, end = random.choice(places)
    return content[:begin] + content[end:]


def head_of_chunk_overwritten(random: Random, content: bytes) -> bytes:
    """Some bytes of a chunk's head are others: opcode, lengths, times, checksum, compression."""
    places = chunks(content)
    if not places:
        return bit_flipped(random, content)
    begin = random.choice(places)[0] + random.randrange(49)
    end = begin + random.choice((1, 2, 4, 8))
    piece = random.choice((random.randbytes(end - begin), bytes(end - begin), b"\xff" * (end - begin)))
    return content[:begin] + piece + content[end:]


def checksum_zero(random: Random, content: bytes) -> bytes:
    """The checksum of a chunk is zero, which says that there is none, and a value in it is another."""
    places = chunks(content)
    if not places:
        return bit_flipped(random, content)
    begin, end = random.choice(places)
    content = content[: begin + 33] + bytes(4) + content[begin + 37 :]
    place = random.randrange(begin + 49, end)
    return content[:place] + bytes([content[place] ^ 0x40]) + content[place + 1 :]


RECORDING: Sequence[Damage] = (
    emptied,
    cut_short,
    cut_short,
    zeroed,
    with_rubbish_behind,
    zeros_behind,
    block_overwritten,
    block_overwritten,
    bit_flipped,
    bit_flipped,
    block_missing,
    block_missing,
    block_put_in,
    block_put_in,
    block_of_zeros,
    block_of_zeros,
    block_repeated,
    block_from_elsewhere,
    several_overwritten,
    chunks_exchanged,
    chunk_repeated,
    chunk_missing,
    head_of_chunk_overwritten,
    head_of_chunk_overwritten,
    checksum_zero,
)
