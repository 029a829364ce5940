"""Damage that knows the layout of a file: counts and lengths that lie, references to nowhere, bombs in XML and zlib."""

import base64
import lzma
import re
import struct
import zlib
from collections.abc import Sequence
from random import Random

import lz4.block

from daq.bad_input.damage.any_file import Damage

_HUGE = (0, 1, 3, 255, 2**16, 2**24, 2**31 - 1, 2**31, 2**32 - 1)
_NUMBER = re.compile(rb"(?<![\w.])-?[0-9]+(\.[0-9]*)?(e[+-]?[0-9]+)?(?![\w.])")
_WORDS = (b"nan", b"inf", b"1e400", b"1e308", b"-1", b"0", b"x", b"99999999999", b"9" * 5000, b"1e-300", b"")
_ATTRIBUTES = (
    b"", b"x", b"-1", b"0", b"99999999999", b"String", b"Float64", b"Int8", b"UInt64", b"object", b"V9", b"ascii",
    b"appended", b"binary", b"BigEndian", b"vtkLZ4DataCompressor", b"vtkZLibDataCompressor", b"vtkLZMADataCompressor",
    b"UInt32", b"base64",
)  # fmt: skip
_ENTITIES = b"""<?xml version="1.0"?>
<!DOCTYPE VTKFile [
<!ENTITY a "0 0 0 0 0 0 0 0 0 0 ">
<!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">
<!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;">
<!ENTITY d "&c;&c;&c;&c;&c;&c;&c;&c;&c;&c;">
<!ENTITY e "&d;&d;&d;&d;&d;&d;&d;&d;&d;&d;">
<!ENTITY f "&e;&e;&e;&e;&e;&e;&e;&e;&e;&e;">
<!ENTITY g "&f;&f;&f;&f;&f;&f;&f;&f;&f;&f;">
<!ENTITY h "&g;&g;&g;&g;&g;&g;&g;&g;&g;&g;">
]>
"""
_COMPRESSORS = (
    (b"vtkZLibDataCompressor", zlib.compress),
    (b"vtkLZMADataCompressor", lzma.compress),
    (b"vtkLZ4DataCompressor", lambda content: lz4.block.compress(content, store_size=False)),
)
_EXTERNAL = b"""<?xml version="1.0"?>
<!DOCTYPE VTKFile [<!ENTITY h SYSTEM "file:///etc/hostname">]>
"""


def count_of_triangles_changed(random: Random, content: bytes) -> bytes:
    """The header of a binary STL file tells another count."""
    return content[:80] + struct.pack("<I", random.choice(_HUGE)) + content[84:]


def corner_changed(random: Random, content: bytes) -> bytes:
    """A coordinate of a binary STL file is another."""
    place = 84 + 50 * random.randrange((len(content) - 84) // 50) + 12 + 4 * random.randrange(9)
    value = random.choice((float("nan"), float("inf"), 3e38, -3e38, 0.0, 1e-40, 1.0))
    return content[:place] + struct.pack("<f", value) + content[place + 4 :]


def number_replaced(random: Random, content: bytes) -> bytes:
    """A number of a text is another."""
    found = random.choice(list(_NUMBER.finditer(content)))
    return content[: found.start()] + random.choice(_WORDS) + content[found.end() :]


def header_count_replaced(random: Random, content: bytes) -> bytes:
    """The header of a PLY file tells another count."""
    head, separator, body = content.partition(b"end_header")
    found = random.choice(list(re.finditer(rb"(?<=element vertex )\d+|(?<=element face )\d+", head)))
    count = random.choice((b"-1", b"0", b"1", b"1000000000000", b"99999999999999999999", b"1e9", b"x"))
    return head[: found.start()] + count + head[found.end() :] + separator + body


def header_type_replaced(random: Random, content: bytes) -> bytes:
    """The header of a PLY file tells another type."""
    head, separator, body = content.partition(b"end_header")
    types = rb"\b(double|float|uchar|int|ascii|binary_little_endian|list|vertex_indices|x)\b"
    found = random.choice(list(re.finditer(types, head)))
    others = (b"char", b"uchar", b"uint", b"double", b"list", b"binary_big_endian", b"half", b"vertex_index")
    return head[: found.start()] + random.choice(others) + head[found.end() :] + separator + body


def with_exploding_entities(_random: Random, content: bytes) -> bytes:
    """An entity that stands for a hundred million numbers ("billion laughs")."""
    return _ENTITIES + _with_entity(content)


def with_external_entity(_random: Random, content: bytes) -> bytes:
    """An entity that stands for another file."""
    return _EXTERNAL + _with_entity(content)


def with_deep_nesting(_random: Random, content: bytes) -> bytes:
    """Elements within elements without end."""
    return content.replace(b"<Piece", b"<a>" * 100_000 + b"<Piece", 1)


def attribute_replaced(random: Random, content: bytes) -> bytes:
    """The value of an attribute is another."""
    found = random.choice(list(re.finditer(rb'(?<==")[^"]*(?=")', content)))
    return content[: found.start()] + random.choice(_ATTRIBUTES) + content[found.end() :]


def with_compressed_bomb(random: Random, content: bytes) -> bytes:
    """An array whose compressed blocks grow to a gigabyte, or tell sizes that they have not."""
    compressor, compress = random.choice(_COMPRESSORS)
    block = compress(bytes(50_000_000))
    blocks, size = random.choice(((20, 50_000_000), (1, 50_000_000), (2**31, 2**31), (1, 16), (2**32 - 1, 1)))
    stored = min(blocks, 20)
    header = struct.pack(f"<{3 + stored}I", blocks, size, 0, *([len(block)] * stored))
    array = base64.b64encode(header) + base64.b64encode(block * stored)
    bomb = b'<DataArray type="Float64" format="binary">' + array + b"</DataArray>"
    head = re.sub(rb' compressor="\w*"', b"", content, count=1)
    head = head.replace(b"<VTKFile ", b'<VTKFile compressor="%s" ' % compressor, 1)
    return re.sub(rb"<DataArray.*?</DataArray>", lambda _: bomb, head, count=1, flags=re.DOTALL)


def record_length_changed(random: Random, content: bytes) -> bytes:
    """A length within an MCAP file is another."""
    starts = _record_starts(content)
    place = random.choice(starts) + 1
    length = random.choice((0, 1, 8, 2**16, 2**31, 2**63, 2**64 - 1))
    return content[:place] + struct.pack("<Q", length) + content[place + 8 :]


def record_kind_changed(random: Random, content: bytes) -> bytes:
    """A record of an MCAP file says to be of another kind."""
    place = random.choice(_record_starts(content))
    return content[:place] + random.randrange(256).to_bytes() + content[place + 1 :]


def record_bytes_changed(random: Random, content: bytes) -> bytes:
    """The first bytes of a record of an MCAP file are others: ids, sizes, lengths of texts."""
    place = random.choice(_record_starts(content)) + 9 + random.randrange(40)
    return (
        content[:place] + random.choice((b"\xff" * 4, b"\0" * 4, random.randbytes(4))) + content[place + 4 :]
    )


def topic_renamed(random: Random, content: bytes) -> bytes:
    """A topic of an MCAP file has another name of the same length."""
    topics = (b"/force/wrench", b"/robot/pose", b"/events", b"/camera/left/image", b"/camera/left/device")
    topic = random.choice([topic for topic in topics if topic in content] or [b"M"])
    other = random.choice((b"/../../../../x", b"/camera/../image", b"\0" * 40, b"/camera/\xff/image"))
    return content.replace(topic, other[: len(topic)].ljust(len(topic), b"."))


def _record_starts(content: bytes) -> list[int]:
    starts, place = [], 8
    while place + 9 <= len(content) - 8:
        starts.append(place)
        place += 9 + int.from_bytes(content[place + 1 : place + 9], "little")
    return starts


def _with_entity(content: bytes) -> bytes:
    body = content.partition(b"?>")[2] or content
    return body.replace(b"</DataArray>", b"&h;</DataArray>", 1)


STL: Sequence[Damage] = (*(count_of_triangles_changed,) * 3, *(corner_changed,) * 5)
NUMBERS: Sequence[Damage] = (number_replaced,) * 10
PLY: Sequence[Damage] = (*(header_count_replaced,) * 4, *(header_type_replaced,) * 5)
VTP: Sequence[Damage] = (
    *(attribute_replaced,) * 12,
    with_exploding_entities,
    with_external_entity,
    with_deep_nesting,
    with_compressed_bomb,
    with_compressed_bomb,
)
MCAP: Sequence[Damage] = (
    *(record_length_changed,) * 8,
    *(record_kind_changed,) * 4,
    *(record_bytes_changed,) * 12,
    *(topic_renamed,) * 3,
)
