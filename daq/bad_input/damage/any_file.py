"""Damage that befalls any file: cut short, overwritten, saved by another program, or no file of that kind at all."""

from collections.abc import Callable, Sequence
from random import Random
from typing import TypeAlias

Damage: TypeAlias = Callable[[Random, bytes], bytes]
"""Makes a broken form of the content of a file."""

_LONGEST_RUBBISH = 4000
_BOM = b"\xef\xbb\xbf"


def emptied(_random: Random, _content: bytes) -> bytes:
    """Nothing is left."""
    return b""


def cut_short(random: Random, content: bytes) -> bytes:
    """The end is missing, as after a full disk."""
    return content[: random.randrange(len(content))]


def without_beginning(random: Random, content: bytes) -> bytes:
    """The beginning is missing."""
    return content[random.randrange(1, len(content)) :]


def overwritten(random: Random, content: bytes) -> bytes:
    """Some bytes are others."""
    damaged = bytearray(content)
    for _ in range(random.choice((1, 1, 2, 8, 64))):
        damaged[random.randrange(len(damaged))] = random.choice((0, 0xFF, 0x80, random.randrange(256)))
    return bytes(damaged)


def zeroed(random: Random, content: bytes) -> bytes:
    """A stretch is zero, as after a loss of power."""
    begin = random.randrange(len(content))
    length = random.randrange(1, len(content) - begin + 1)
    return content[:begin] + bytes(length) + content[begin + length :]


def rubbish(random: Random, _content: bytes) -> bytes:
    """Random bytes."""
    return random.randbytes(random.randrange(1, _LONGEST_RUBBISH))


def doubled(_random: Random, content: bytes) -> bytes:
    """The content stands there twice."""
    return content + content


def with_rubbish_behind(random: Random, content: bytes) -> bytes:
    """Random bytes follow."""
    return content + random.randbytes(random.randrange(1, 200))


def in_another_format(random: Random, _content: bytes) -> bytes:
    """A file of another kind under this name."""
    return random.choice(
        (
            b"\x89PNG\r\n\x1a\n" + random.randbytes(60),
            b"PK\x03\x04" + random.randbytes(60),
            b"%PDF-1.7\n" + random.randbytes(60),
            b"\x80\x04\x95\x17\x00\x00\x00\x00\x00\x00\x00\x8c\x02os\x94\x8c\x06system\x94\x93\x94\x8c\x04true\x94\x85\x94R\x94.",
            b"<!DOCTYPE html><html><body>404 Not Found</body></html>",
            b"{}",
            b"[]",
            b"null",
            b"solid nothing\nendsolid nothing\n",
        )
    )


def as_utf16(random: Random, content: bytes) -> bytes:
    """Saved in UTF-16, as some editors do."""
    return content.decode("utf-8", "replace").encode(
        random.choice(("utf-16", "utf-16-le", "utf-16-be", "utf-32"))
    )


def in_latin_1(_random: Random, content: bytes) -> bytes:
    """Saved in an encoding of Western Europe, with a letter of it."""
    return content.replace(b"\n", "é\n".encode("latin-1"), 1)


def with_byte_order_mark(_random: Random, content: bytes) -> bytes:
    """Saved with a byte-order mark."""
    return _BOM + content


def with_carriage_returns(random: Random, content: bytes) -> bytes:
    """Saved with the line ends of another system."""
    return content.replace(b"\n", random.choice((b"\r\n", b"\r")))


def with_zero_byte(random: Random, content: bytes) -> bytes:
    """A zero byte has come in between."""
    place = random.randrange(len(content) + 1)
    return content[:place] + b"\0" + content[place:]


def without_line(random: Random, content: bytes) -> bytes:
    """A line is missing."""
    lines = content.splitlines(keepends=True)
    del lines[random.randrange(len(lines))]
    return b"".join(lines)


def with_line_twice(random: Random, content: bytes) -> bytes:
    """A line stands there twice."""
    lines = content.splitlines(keepends=True)
    place = random.randrange(len(lines))
    return b"".join([*lines[:place], lines[place], *lines[place:]])


def with_lines_swapped(random: Random, content: bytes) -> bytes:
    """Two lines have changed places."""
    lines = content.splitlines(keepends=True)
    one, other = random.randrange(len(lines)), random.randrange(len(lines))
    lines[one], lines[other] = lines[other], lines[one]
    return b"".join(lines)


def with_endless_line(random: Random, content: bytes) -> bytes:
    """A line is very long."""
    lines = content.splitlines(keepends=True)
    place = random.randrange(len(lines))
    lines[place] = (
        lines[place].rstrip(b"\n") + random.choice((b"9", b"[", b"x", b'"', b",")) * 200_000 + b"\n"
    )
    return b"".join(lines)


def with_character_typed(random: Random, content: bytes) -> bytes:
    """A character was mistyped, left out or put in."""
    place = random.randrange(len(content))
    typed = random.choice(b"\"'[]{}=,;.:#-+eE \n\t0x<>&%/\\").to_bytes()
    return content[:place] + typed + content[place + random.choice((0, 1)) :]


WHOLE: Sequence[Damage] = (emptied, cut_short, rubbish, in_another_format)
BINARY: Sequence[Damage] = (
    *WHOLE,
    without_beginning,
    overwritten,
    overwritten,
    overwritten,
    zeroed,
    doubled,
    with_rubbish_behind,
    with_carriage_returns,
)
TEXT: Sequence[Damage] = (
    *WHOLE,
    overwritten,
    doubled,
    as_utf16,
    in_latin_1,
    with_byte_order_mark,
    with_carriage_returns,
    with_zero_byte,
    without_line,
    with_line_twice,
    with_lines_swapped,
    with_endless_line,
    with_character_typed,
    with_character_typed,
)
