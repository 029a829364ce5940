"""The part of the protobuf wire format that EGM uses, driven by annotations on frozen dataclasses.

A message annotates each field with its kind and number, as in ``seqno: Annotated[int | None, uint(1)] =
None``; a field without a default is required. :func:`encode` writes what is set, in ascending number order
and repeated doubles unpacked (proto2's way); :func:`decode` takes unpacked and packed doubles, skips
unknown fields and refuses everything malformed.
"""

import dataclasses
import struct
from collections.abc import Callable, Hashable
from functools import cache
from typing import Any, Protocol, TypeVar, cast, get_type_hints

from robot_drivers.errors import DeviceProtocolError

Message = TypeVar("Message")

VARINT, FIXED64, LENGTH_DELIMITED, FIXED32 = 0, 1, 2, 5

_UINT64 = 0xFFFFFFFFFFFFFFFF
_LONGEST_VARINT = 10
_DOUBLE = struct.Struct("<d")


class _Kind(Protocol):
    """One kind of field; ``before`` is what the message already holds for the field."""

    @property
    def number(self) -> int: ...

    def write(self, value: Any) -> bytes: ...

    def read(self, wire_type: int, raw: int | bytes, before: Any) -> Any: ...


def uint(number: int) -> _Kind:
    """A uint32, uint64 or enumeration field."""
    return _Varint(number, int)


def boolean(number: int) -> _Kind:
    """A bool field."""
    return _Varint(number, bool)


def double(number: int) -> _Kind:
    """A double field."""
    return _Double(number)


def doubles(number: int, at_most: int) -> _Kind:
    """A repeated double field, a tuple; more than ``at_most`` values are malformed."""
    return _Doubles(number, at_most)


def message(number: int, layout: type[Any]) -> _Kind:
    """An embedded message of the dataclass ``layout``."""
    return _Embedded(number, lambda _: layout)


def message_by_content(number: int, layout: Callable[[bytes], type[Any]]) -> _Kind:
    """An embedded message whose dataclass depends on its bytes."""
    return _Embedded(number, layout)


def encode(value: Any) -> bytes:
    """Return the wire bytes of a message."""
    return b"".join(
        kind.write(field_value)
        for name, kind in _layout(type(value)).fields.values()
        if (field_value := getattr(value, name)) is not None
    )


def decode(layout: type[Message], data: bytes) -> Message:
    """Read a message.

    Raises
    ------
    DeviceProtocolError
        When the bytes are no such message: truncated, a field of another wire type, a required field missing, or
        one that is not repeated there twice (protobuf would take the later one; no sender means that).
    """
    fields = _layout(layout).fields
    values: dict[str, Any] = {}
    position = 0
    while position < len(data):
        number, wire_type, raw, position = _read_field(data, position)
        if number in fields:
            name, kind = fields[number]
            if name in values and not isinstance(kind, _Doubles):
                raise DeviceProtocolError(f"{layout.__name__}.{name} is there twice")
            try:
                values[name] = kind.read(wire_type, raw, values.get(name))
            except DeviceProtocolError as error:
                raise DeviceProtocolError(f"{layout.__name__}.{name}: {error}") from None
    for name in _layout(layout).required:
        if name not in values:
            raise DeviceProtocolError(f"{layout.__name__} lacks its required field {name}")
    return layout(**values)


def first_field(data: bytes) -> tuple[int, int] | None:
    """Return (field number, wire type) of the first field, None for an empty message."""
    return _read_field(data, 0)[:2] if data else None


@dataclasses.dataclass(frozen=True, slots=True)
class _Layout:
    """The fields of a message by number, ascending, and the names of the required ones."""

    fields: dict[int, tuple[str, _Kind]]
    required: tuple[str, ...]


def _layout(message_type: type[Any]) -> _Layout:
    return _annotated_layout(cast(Hashable, message_type))  # mypy takes the class for one of its instances


@cache
def _annotated_layout(message_type: Any) -> _Layout:
    hints = get_type_hints(message_type, include_extras=True)
    kinds = {name: hint.__metadata__[0] for name, hint in hints.items()}
    return _Layout(
        {kind.number: (name, kind) for name, kind in sorted(kinds.items(), key=lambda item: item[1].number)},
        tuple(f.name for f in dataclasses.fields(message_type) if f.default is dataclasses.MISSING),
    )


@dataclasses.dataclass(frozen=True, slots=True)
class _Varint:
    number: int
    convert: Callable[[int], int]

    def write(self, value: Any) -> bytes:
        return _tag(self.number, VARINT) + _varint(int(value) & _UINT64)

    def read(self, wire_type: int, raw: int | bytes, before: Any) -> Any:
        if not isinstance(raw, int):
            raise _wrong_wire_type(wire_type)
        return self.convert(raw)


@dataclasses.dataclass(frozen=True, slots=True)
class _Double:
    number: int

    def write(self, value: Any) -> bytes:
        return _tag(self.number, FIXED64) + _DOUBLE.pack(value)

    def read(self, wire_type: int, raw: int | bytes, before: Any) -> Any:
        if wire_type != FIXED64 or isinstance(raw, int):
            raise _wrong_wire_type(wire_type)
        return _DOUBLE.unpack(raw)[0]


@dataclasses.dataclass(frozen=True, slots=True)
class _Doubles:
    number: int
    at_most: int

    def write(self, value: Any) -> bytes:
        tag = _tag(self.number, FIXED64)
        return b"".join(tag + _DOUBLE.pack(element) for element in value)

    def read(self, wire_type: int, raw: int | bytes, before: Any) -> Any:
        if wire_type not in (FIXED64, LENGTH_DELIMITED) or isinstance(raw, int):
            raise _wrong_wire_type(wire_type)
        if len(raw) % _DOUBLE.size:
            raise DeviceProtocolError(f"{len(raw)} bytes are no whole number of packed doubles")
        values = (before or ()) + tuple(element for (element,) in _DOUBLE.iter_unpack(raw))
        if len(values) > self.at_most:
            raise DeviceProtocolError(f"more than {self.at_most} values")
        return values


@dataclasses.dataclass(frozen=True, slots=True)
class _Embedded:
    number: int
    layout: Callable[[bytes], type[Any]]

    def write(self, value: Any) -> bytes:
        content = encode(value)
        return _tag(self.number, LENGTH_DELIMITED) + _varint(len(content)) + content

    def read(self, wire_type: int, raw: int | bytes, before: Any) -> Any:
        if wire_type != LENGTH_DELIMITED or isinstance(raw, int):
            raise _wrong_wire_type(wire_type)
        return decode(self.layout(raw), raw)


def _wrong_wire_type(wire_type: int) -> DeviceProtocolError:
    return DeviceProtocolError(f"wire type {wire_type} does not fit the field")


def _read_field(data: bytes, position: int) -> tuple[int, int, int | bytes, int]:
    """Return field number, wire type, raw value and the position behind it."""
    key, position = _read_varint(data, position)
    number, wire_type = key >> 3, key & 7
    if number == 0:
        raise DeviceProtocolError(f"field number 0 before byte {position}")
    if wire_type == VARINT:
        value, position = _read_varint(data, position)
        return number, wire_type, value, position
    if wire_type == FIXED64:
        length = 8
    elif wire_type == FIXED32:
        length = 4
    elif wire_type == LENGTH_DELIMITED:
        length, position = _read_varint(data, position)
    else:
        raise DeviceProtocolError(f"unknown wire type {wire_type} before byte {position}")
    end = position + length
    if end > len(data):
        raise DeviceProtocolError(f"truncated: field {number} wants byte {end} of {len(data)}")
    return number, wire_type, data[position:end], end


def _read_varint(data: bytes, position: int) -> tuple[int, int]:
    if position < len(data) and data[position] < 0x80:  # nearly all of them, and quicker so
        return data[position], position + 1
    value = 0
    for index, byte in enumerate(data[position : position + _LONGEST_VARINT]):
        value |= (byte & 0x7F) << (7 * index)
        if byte < 0x80:
            return value & _UINT64, position + index + 1
    raise DeviceProtocolError(f"no end of the number at byte {position}")


@cache
def _tag(number: int, wire_type: int) -> bytes:
    return _varint(number << 3 | wire_type)


def _varint(value: int) -> bytes:
    encoded = bytearray()
    while value > 0x7F:
        encoded.append(value & 0x7F | 0x80)
        value >>= 7
    encoded.append(value)
    return bytes(encoded)
