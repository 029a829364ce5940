"""Where a process of this computer listens, by what the kernel says (Linux)."""

import socket
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

_LISTENS = 0x0A
_UNIX_LISTENS = 1 << 16  # __SO_ACCEPTCON


@dataclass(frozen=True)
class Ear:
    """A socket that takes what comes: its protocol, and its address and port, or its path."""

    protocol: str
    address: str
    port: int = 0


def ears(process_id: int) -> set[Ear]:
    """Bound UDP sockets, listening TCP sockets and listening sockets with a path, of one process."""
    own = set(_sockets_of(process_id))
    found = set()
    for protocol in ("tcp", "udp", "tcp6", "udp6"):
        for fields in _table(process_id, protocol):
            address, port = fields[1].split(":")
            heard = protocol.startswith("udp") or int(fields[3], 16) == _LISTENS
            if heard and fields[9] in own:
                found.add(Ear(protocol, _address(address), int(port, 16)))
    for fields in _table(process_id, "unix"):
        if int(fields[3], 16) & _UNIX_LISTENS and fields[6] in own:
            found.add(Ear("unix", fields[7] if len(fields) > 7 else ""))
    return found


def _sockets_of(process_id: int) -> Iterator[str]:
    for descriptor in Path(f"/proc/{process_id}/fd").iterdir():
        try:
            target = str(descriptor.readlink())
        except FileNotFoundError:
            continue  # closed meanwhile
        if target.startswith("socket:["):
            yield target[len("socket:[") : -1]


def _table(process_id: int, protocol: str) -> Iterator[list[str]]:
    lines = Path(f"/proc/{process_id}/net/{protocol}").read_text(encoding="ascii").splitlines()
    return (line.split() for line in lines[1:])


def _address(hexadecimal: str) -> str:
    """Return an address from words of four bytes in the order of this machine."""
    words = [int(hexadecimal[at : at + 8], 16) for at in range(0, len(hexadecimal), 8)]
    family = socket.AF_INET if len(words) == 1 else socket.AF_INET6
    return socket.inet_ntop(family, b"".join(struct.pack("=I", word) for word in words))
