"""Fuzz target: the replies of an open-abb server."""

import math
import re
from random import Random

from robot_drivers.abb.open_abb.messages import find_info, parse_joints, parse_pose, parse_reply
from robot_drivers.fuzzing.mutations import mutated, overwritten
from robot_drivers.fuzzing.target import Target, WrongValueError, agree

_REPLIES = (
    b"0 1 ",
    b"3 1 450.00 20.00 600.00 0.000 0.000 1.000 0.000",
    b"3 1 450.00 20.00 600.00 0.500 -0.500 0.500 -0.500",
    b"4 1 0.00 10.00 20.00 0.00 45.00 -0.05",
    b"98 1 140-500000*6.08*IRB 140-6/0.8",
)
_PLAIN = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"


def _reply(random: Random) -> bytes:
    return (mutated if random.random() < 0.4 else overwritten)(random, _REPLIES)


def _check_reply(received: bytes) -> bool:
    """Every number is a word of the reply, written as a RAPID program writes numbers."""
    find_info(received)
    reply = parse_reply(received)
    head = re.match(rb"\s*([0-9]+) ([01])", received)
    if head is None:
        raise WrongValueError("a reply without code and verdict")
    agree((reply.code, reply.ok), (int(head[1]), head[2] == b"1"), "reply")
    words = reply.payload.split()
    if len(words) == 6:
        angles = [math.degrees(q) for q in parse_joints(reply.payload)]
        _agree_with_words(angles, words)
    else:
        pose = parse_pose(reply.payload)
        _agree_with_words([1e3 * p for p in pose.position], words[:3])
        _agree_with_words([], words[3:])
    return True


def _agree_with_words(numbers: list[float], words: list[str]) -> None:
    if not all(re.fullmatch(_PLAIN, word) for word in words):
        raise WrongValueError(f"{words} were taken for numbers")
    for number, word in zip(numbers, words, strict=False):
        if not math.isclose(number, float(word), rel_tol=1e-12, abs_tol=1e-300):
            raise WrongValueError(f"{word!r} was taken for {number}")


TARGETS = (Target("open-abb-reply", "each number is a plain word of the reply", _reply, _check_reply),)
