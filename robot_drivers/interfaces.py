"""Which network interface of this computer leads to a device, so that a socket listens there and nowhere else."""

import ipaddress
import socket

LOOPBACK = "127.0.0.1"

_ANY_PORT = 9  # nothing is sent: connecting a UDP socket only asks for the route


def address_towards(host: str) -> str:
    """Return this computer's IPv4 address on the interface that leads to ``host``.

    Raises
    ------
    OSError
        The name has no address, or no route leads there.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect((host, _ANY_PORT))
        return str(probe.getsockname()[0])


def is_loopback(address: str) -> bool:
    """Tell whether only this computer reaches an address."""
    return address == "localhost" or (is_address(address) and ipaddress.ip_address(address).is_loopback)


def is_address(text: str) -> bool:
    """Tell whether a text is an IP address."""
    try:
        ipaddress.ip_address(text)
    except ValueError:
        return False
    return True
