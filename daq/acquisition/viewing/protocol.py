"""Messages of the Foxglove WebSocket protocol, version 1, as a server that can only be looked at speaks it.

Text frames hold JSON with an ``op``; a binary frame with the opcode 1 holds a message of a channel. The protocol is
that of the subprotocols ``foxglove.sdk.v1`` and ``foxglove.websocket.v1``, its name before. Reference: Foxglove SDK,
``rust/foxglove/src/protocol/v1``.
"""

import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

SUBPROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
_MESSAGE_DATA = struct.Struct("<BIQ")
_OPCODE_OF_DATA = 1
_LARGEST_ID = 2**32 - 1
_WARNING = 1


@dataclass(frozen=True, slots=True)
class Channel:
    """What a topic carries, as it is advertised."""

    number: int
    topic: str
    encoding: str
    schema_name: str
    schema_encoding: str
    schema: str


@dataclass(frozen=True, slots=True)
class Subscribe:
    """A viewer wants channels: its own numbers of the subscriptions, each with the channel's."""

    channels: dict[int, int]


@dataclass(frozen=True, slots=True)
class Unsubscribe:
    """A viewer no longer wants these subscriptions."""

    subscriptions: tuple[int, ...]


class UnknownRequestError(ValueError):
    """A viewer asks for what this server does not do; the text is for it to read."""


def server_info(name: str, session_id: str) -> str:
    """Return who the server is: it has no capability, so that nothing can be sent, set or called."""
    return _text("serverInfo", name=name, capabilities=[], sessionId=session_id)


def advertise(channels: Sequence[Channel]) -> str:
    """Return which channels there are."""
    told = [
        {
            "id": one.number,
            "topic": one.topic,
            "encoding": one.encoding,
            "schemaName": one.schema_name,
            "schemaEncoding": one.schema_encoding,
            "schema": one.schema,
        }
        for one in channels
    ]
    return _text("advertise", channels=told)


def warning(message: str) -> str:
    """Return a line for the viewer to show."""
    return _text("status", level=_WARNING, message=message)


def message_data(subscription: int, log_time_ns: int, data: bytes) -> bytes:
    """Return a message of a channel for a subscription; the time is Unix time."""
    return _MESSAGE_DATA.pack(_OPCODE_OF_DATA, subscription, log_time_ns) + data


def understood(request: str | bytes) -> Subscribe | Unsubscribe:
    """Return what a viewer asks for.

    Raises
    ------
    UnknownRequestError
        It is no message of the protocol, or one that would change something.
    """
    if isinstance(request, bytes):
        raise UnknownRequestError("this server only shows; nothing can be sent to it")
    try:
        content = json.loads(request)
    except (ValueError, RecursionError):
        raise UnknownRequestError("that is no JSON") from None
    operation = content.get("op") if isinstance(content, dict) else None
    if operation == "subscribe":
        asked = content.get("subscriptions")
        pairs = [(_number(one, "id"), _number(one, "channelId")) for one in _list(asked)]
        return Subscribe(dict(pairs))
    if operation == "unsubscribe":
        return Unsubscribe(tuple(_whole(one) for one in _list(content.get("subscriptionIds"))))
    raise UnknownRequestError(f"this server only shows, and does not know {str(operation)[:40]!r}")


def _list(value: object) -> list[Any]:
    if not isinstance(value, list):
        raise UnknownRequestError("a list is missing")
    return value


def _number(entry: object, key: str) -> int:
    return _whole(entry.get(key) if isinstance(entry, dict) else None)


def _whole(value: object) -> int:
    if type(value) is not int or not 0 <= value <= _LARGEST_ID:
        raise UnknownRequestError("a number is missing, or none from 0 to 4294967295")
    return value


def _text(operation: str, **content: object) -> str:
    return json.dumps({"op": operation, **content})
