"""GVSP, the stream protocol of GigE Vision: an image as leader, payload packets and trailer, with or without chunks.

Sources: the protocol's public dissector in Wireshark (packet-gvsp.c) and the headers of Aravis.
"""

import struct
from dataclasses import dataclass

from robot_drivers.genicam.emulator.description import IMAGE_CHUNK, TIMESTAMP_CHUNK

_IP_AND_UDP_BYTES = 28
_HEADER = struct.Struct(">HHI")
_LEADER, _TRAILER, _PAYLOAD = 1 << 24, 2 << 24, 3 << 24
_IMAGE, _WITH_CHUNKS = 0x0001, 0x4000
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


def test_packet(packet_bytes: int) -> bytes:
    """Return the datagram by which a client tries whether so large ones arrive."""
    return bytes(max(0, packet_bytes - _IP_AND_UDP_BYTES))
