"""Messages of ROS as objects: CDR of ROS 2 and the wire format of ROS 1, by the definitions that the bag holds.

A bag in SQLite3 of a release before Iron has no definitions; its types are taken for those that ROS 2 defines.
"""

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, TypeAlias

from daq.bags.storage import Topic
from daq.errors import RecordingError

Decode: TypeAlias = Callable[[bytes | memoryview], Any]

_IDL_PARTS = "=" * 80 + "\n"
_HINT = "pip install 'retraction[ros2]'"


class UnknownTypeError(ValueError):
    """Messages whose encoding or type is not known; the text says which."""


def require_library(path: Path) -> None:
    """Raise RecordingError where the library that knows the messages is not installed."""
    try:
        import rosbags  # noqa: F401 - only whether it is there
    except ImportError:
        raise RecordingError(f"{path}: messages of ROS need the library rosbags; {_HINT}") from None


def decoder_of(topic: Topic) -> Decode:
    """Return the function that decodes a message of a topic.

    Raises
    ------
    UnknownTypeError
        The encoding is another, or the type is defined neither in the bag nor by ROS 2.
    """
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    if topic.encoding not in ("cdr", "ros1"):
        raise UnknownTypeError(f"is encoded as {topic.encoding or 'nothing that is named'}, not as CDR")
    name = _full_name(topic.type_name)
    store = get_typestore(Stores.EMPTY)
    try:
        if topic.definition_format in ("ros2msg", "ros1msg"):
            store.register(get_types_from_msg(topic.definition, name))
        elif topic.definition_format == "ros2idl":
            for part in topic.definition.split(_IDL_PARTS):
                text = part.partition("\n")[2] if part.startswith("IDL: ") else part
                if text.strip():
                    store.register(get_types_from_idl(text))
        else:
            store = get_typestore(Stores.LATEST)
        store.get_msgdef(name)
    except Exception as error:  # noqa: BLE001 - a damaged definition makes the library raise whatever it comes upon
        why = f"whose definition cannot be read ({type(error).__name__})"
        if not topic.definition:
            why = "which neither the bag nor ROS 2 defines"
        raise UnknownTypeError(f"is of the type {topic.type_name or 'without a name'}, {why}") from None
    decode = store.deserialize_cdr if topic.encoding == "cdr" else store.deserialize_ros1
    return lambda body: decode(body, name)


def decoded(decode: Decode, data: Iterable[bytes | memoryview]) -> Iterator[tuple[int, Any]]:
    """Yield the messages that can be decoded, each with its place."""
    for place, body in enumerate(data):
        try:
            message = decode(body)
        except Exception:  # noqa: BLE001 - a damaged message makes the library raise whatever it comes upon
            continue
        yield place, message


def _full_name(type_name: str) -> str:
    """Return the name of a type as ROS 2 spells it; ROS 1 leaves the ``msg`` out."""
    package, _, name = type_name.partition("/")
    return f"{package}/msg/{name}" if name and "/" not in name else type_name
