"""What goes wrong with bytes on their way, and the bytes that nobody expects."""

import struct
from collections.abc import Callable, Sequence
from random import Random

LONGEST = 4096
"""Bytes that no mutated input exceeds."""

_AWKWARD = (
    b"\x00",
    b"\xff",
    b"\x80",
    b"\x7f",
    b"\x00\x80",
    b"\xff\x7f",
    b"\xff\xff\xff\xff",
    b"\x80\x00\x00\x00",
    b"\xff" * 10,  # a number without end for protobuf
    *(struct.pack("<d", value) for value in (float("nan"), float("inf"), -0.0, 5e-324, 1e308)),
    *(struct.pack(order, value) for order in ("<f", ">f") for value in (float("nan"), float("inf"), 1e38)),
)


def mutated(random: Random, seeds: Sequence[bytes]) -> bytes:
    """Return one of the seeds with up to four changes; now and then unchanged, or random bytes altogether."""
    kind = random.random()
    if kind < 0.05:
        return random.choice(seeds)
    if kind < 0.1:
        return random.randbytes(random.randrange(400))
    data = bytearray(random.choice(seeds))
    for _ in range(random.choice((1, 1, 2, 4))):
        random.choice(_MUTATIONS)(random, data)
    if kind < 0.15:
        data += random.choice(seeds)
    return bytes(data[:LONGEST])


def overwritten(random: Random, seeds: Sequence[bytes]) -> bytes:
    """Return one of the seeds with up to four changes that keep its length."""
    data = bytearray(random.choice(seeds))
    for _ in range(random.randrange(5)):
        random.choice((_flip_bit, _change_byte, _place_awkward))(random, data)
    return bytes(data)


def _place(random: Random, data: bytearray) -> int:
    return random.randrange(len(data)) if data else 0


def _flip_bit(random: Random, data: bytearray) -> None:
    if data:
        data[_place(random, data)] ^= 1 << random.randrange(8)


def _change_byte(random: Random, data: bytearray) -> None:
    if data:
        data[_place(random, data)] = random.randrange(256)


def _place_awkward(random: Random, data: bytearray) -> None:
    piece = random.choice(_AWKWARD)
    if len(piece) <= len(data):
        place = random.randrange(len(data) - len(piece) + 1)
        data[place : place + len(piece)] = piece


def _delete(random: Random, data: bytearray) -> None:
    place = _place(random, data)
    del data[place : place + random.choice((1, 1, 2, random.randrange(1, 40)))]


def _insert(random: Random, data: bytearray) -> None:
    place = _place(random, data)
    data[place:place] = random.choice((random.randbytes(1), random.randbytes(random.randrange(40))))


def _insert_awkward(random: Random, data: bytearray) -> None:
    place = _place(random, data)
    data[place:place] = random.choice(_AWKWARD)


def _repeat(random: Random, data: bytearray) -> None:
    place = _place(random, data)
    piece = data[place : place + random.randrange(1, 60)]
    data[place:place] = piece * random.choice((1, 1, 8))


def _truncate(random: Random, data: bytearray) -> None:
    del data[_place(random, data) :]


_MUTATIONS: tuple[Callable[[Random, bytearray], None], ...] = (
    _flip_bit,
    _change_byte,
    _place_awkward,
    _delete,
    _insert,
    _insert_awkward,
    _repeat,
    _truncate,
)


def disturbed(random: Random, items: Sequence[bytes]) -> list[bytes]:
    """Return datagrams as a bad network delivers them: lost, doubled, in another order, cut, mixed with rubbish."""
    arriving: list[bytes] = []
    loss, doubling, swapping, cutting, rubbish = (random.choice((0.0, 0.02, 0.2)) for _ in range(5))
    for item in items:
        if random.random() < loss:
            continue
        if random.random() < cutting:
            arriving.append(item[: random.randrange(len(item))])
            continue
        arriving.append(item)
        if random.random() < doubling:
            arriving.append(item)
        if random.random() < rubbish:
            arriving.append(random.randbytes(random.choice((len(item), random.randrange(80)))))
        if len(arriving) > 1 and random.random() < swapping:
            arriving[-1], arriving[-2] = arriving[-2], arriving[-1]
    return arriving
