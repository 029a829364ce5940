"""Who may look on while a rig is used: the table ``[viewers]`` of a rig file."""

import ipaddress
from dataclasses import dataclass

LOOPBACK = "127.0.0.1"
_FEWEST_LETTERS = 16


@dataclass(frozen=True, slots=True)
class Viewers:
    """Programs of the Foxglove protocol that may see what a rig measures; none of them can change anything.

    Attributes
    ----------
    port : of the WebSocket server; 0 for any that is free
    bind_address : where it listens; this computer alone if nothing is said
    token : what a viewer has to know, as ``ws://ADDRESS:PORT/?token=TOKEN``; needed beyond this computer
    origins : web pages that may connect without the token, by their origin
    """

    port: int = 8765
    bind_address: str = LOOPBACK
    token: str = ""
    origins: tuple[str, ...] = ("https://app.foxglove.dev",)

    def __post_init__(self) -> None:
        if not 0 <= self.port < 2**16:
            raise ValueError(f"port must be from 0 to 65535, not {self.port}")
        try:
            loopback = ipaddress.ip_address(self.bind_address).is_loopback
        except ValueError:
            raise ValueError(
                f"bind_address must be an address of this computer, not {self.bind_address!r}"
            ) from None
        if self.token and (len(self.token) < _FEWEST_LETTERS or not self.token.isascii()):
            raise ValueError(f"token must have {_FEWEST_LETTERS} letters of ASCII or more")
        if not loopback and not self.token:
            raise ValueError(
                f"token is missing, and bind_address {self.bind_address} is seen by other computers; write one of "
                f"{_FEWEST_LETTERS} letters or more"
            )
