"""GVSP, the stream protocol of GigE Vision: an image as leader, payload packets and trailer, with or without chunks.

Sources: the protocol's public dissector in Wireshark (packet-gvsp.c) and the headers of Aravis.
"""

import struct
from dataclasses import dataclass

from robot_drivers.genicam.emulator.description import IMAGE_CHUNK, TIMESTAMP_CHUNK

_IP_AND_UDP_BYTES = 28
_HEADER = struct.Struct(">HHI")
_LEADER, _TRAILER, _PAYLOAD, _MULTIPART = 1 << 24, 2 << 24, 3 << 24, 7 << 24
_IMAGE, _PARTS, _WITH_CHUNKS = 0x0001, 0x000A, 0x4000
_EXTENDED = 0x80 << 24
_EXTENDED_HEADER = struct.Struct(">HHIQI")
_PART = struct.Struct(">HHIIHBBIHHIIIIHHI")
_PART_HEADER = struct.Struct(">BBHI")
_2D_IMAGE, _3D_IMAGE = 0x0001, 0x0005
_CHUNK_INFO = struct.Struct(">II")


@dataclass(frozen=True, slots=True)
class Block:
    """One image on its way.

    Attributes
    ----------
    number : 1..65535, after which 1 follows
    timestamp : ticks of the camera's clock, at the exposure
    pixel_format, width, height : of the image
    content : its bytes
    chunk_timestamp : to be appended as a chunk; None for no chunks
    """

    number: int
    timestamp: int
    pixel_format: int
    width: int
    height: int
    content: bytes
    chunk_timestamp: int | None

    def packets(self, packet_bytes: int) -> list[bytes]:
        """Return the datagrams, of up to ``packet_bytes`` with the headers of IP and UDP."""
        payload_type = _IMAGE if self.chunk_timestamp is None else _IMAGE | _WITH_CHUNKS
        leader = struct.pack(
            ">2xHQIIIIIHH",
            *(payload_type, self.timestamp, self.pixel_format),
            *(self.width, self.height, 0, 0, 0, 0),
        )
        payload = self._payload()
        size = packet_bytes - _IP_AND_UDP_BYTES - _HEADER.size
        pieces = [payload[begin : begin + size] for begin in range(0, len(payload), size)]
        trailer = struct.pack(">2xHI", payload_type, self.height)
        kinds = [(_LEADER, leader), *((_PAYLOAD, piece) for piece in pieces), (_TRAILER, trailer)]
        return [
            _HEADER.pack(0, self.number, kind | place) + content
            for place, (kind, content) in enumerate(kinds)
        ]

    def _payload(self) -> bytes:
        if self.chunk_timestamp is None:
            return self.content
        chunks = ((IMAGE_CHUNK, self.content), (TIMESTAMP_CHUNK, struct.pack(">Q", self.chunk_timestamp)))
        return b"".join(content + _CHUNK_INFO.pack(name, len(content)) for name, content in chunks)


@dataclass(frozen=True, slots=True)
class PartOfBlock:
    """One part: id of its component, its pixel format, size in px, and its bytes."""

    component: int
    pixel_format: int
    width: int
    height: int
    content: bytes


@dataclass(frozen=True, slots=True)
class MultipartBlock:
    """Several images of one exposure on their way, in one block.

    Attributes
    ----------
    number : 64 bits with extended ids, else as of :class:`Block`
    timestamp : as of :class:`Block`
    parts : one image each
    extended_ids : whether the numbers of blocks and packets have fields of their own
    """

    number: int
    timestamp: int
    parts: tuple[PartOfBlock, ...]
    extended_ids: bool

    def packets(self, packet_bytes: int) -> list[bytes]:
        """Return the datagrams as :meth:`Block.packets`; each part begins with one of its own."""
        leader = struct.pack(">2xHQ", _PARTS, self.timestamp) + b"".join(map(_described, self.parts))
        header_bytes = _EXTENDED_HEADER.size if self.extended_ids else _HEADER.size
        size = packet_bytes - _IP_AND_UDP_BYTES - header_bytes - _PART_HEADER.size
        payload, before = [], 0
        for number, part in enumerate(self.parts):
            for begin in range(0, len(part.content), size):
                head = _PART_HEADER.pack(number, 0, before + begin >> 32, before + begin & 0xFFFF_FFFF)
                payload.append((_MULTIPART, head + part.content[begin : begin + size]))
            before += len(part.content)
        trailer = struct.pack(">2xHI", _PARTS, self.parts[0].height)
        kinds = [(_LEADER | len(self.parts), leader), *payload, (_TRAILER, trailer)]
        return [self._header(kind, place) + content for place, (kind, content) in enumerate(kinds)]

    def _header(self, kind: int, place: int) -> bytes:
        if self.extended_ids:
            return _EXTENDED_HEADER.pack(0, 0, _EXTENDED | kind, self.number, place)
        return _HEADER.pack(0, self.number, kind | place)


def _described(part: PartOfBlock) -> bytes:
    """Return what the leader tells of a part."""
    size, kind = len(part.content), _2D_IMAGE if part.component == 1 else _3D_IMAGE
    return _PART.pack(
        *(kind, size >> 32, size & 0xFFFF_FFFF, part.pixel_format),
        *(0, 0, 0, 0, part.component, 0),
        *(part.width, part.height, 0, 0, 0, 0, 0),
    )


def test_packet(packet_bytes: int) -> bytes:
    """Return the datagram by which a client tries whether so large ones arrive."""
    return bytes(max(0, packet_bytes - _IP_AND_UDP_BYTES))
