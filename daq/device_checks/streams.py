"""What is checked of any device that streams: who it is, how fast it counts, what it loses."""

import math
import time
from collections.abc import Callable, Sequence, Sized
from typing import TypeVar

import numpy as np

from daq.device_checks.report import Check
from robot_drivers.protocols import DeviceIdentity, PoseBlock, StreamStatistics, WrenchBlock

_READ_S = 0.2
_RATE_TOLERANCE = 0.05

Block = TypeVar("Block", bound=Sized)


def counting_rate_hz(blocks: Sequence[WrenchBlock] | Sequence[PoseBlock]) -> float:
    """Return how fast the device counts, lost samples included."""
    counter = np.concatenate([block.counter for block in blocks])
    time_s = np.concatenate([block.host_time_ns for block in blocks]) * 1e-9
    span_s = float(time_s[-1] - time_s[0])
    return float(counter[-1] - counter[0]) / span_s if span_s > 0 else math.nan


def collected(read: Callable[[float], Block], seconds: float) -> list[Block]:
    """Return what comes for so long, but for empty answers."""
    end_s = time.monotonic() + seconds
    blocks = []
    while (left_s := end_s - time.monotonic()) > 0:
        block = read(min(_READ_S, left_s))
        if len(block):
            blocks.append(block)
    return blocks


def identity_check(identity: DeviceIdentity) -> Check:
    """Judge whether the device says what it is."""
    serial = f" {identity.serial}" if identity.serial else ""
    return Check("identity", bool(identity.model), f"{identity.model}{serial}")


def rate_check(rate_hz: float, wanted_hz: float | None) -> Check:
    """Judge a rate against the one that the settings ask for; where they ask for none, there need only be one."""
    if wanted_hz is None:
        return Check("rate", math.isfinite(rate_hz), f"{rate_hz:.1f} Hz")
    passed = abs(rate_hz - wanted_hz) <= _RATE_TOLERANCE * wanted_hz
    told = f"{rate_hz:.1f} Hz" if passed else f"{rate_hz:.1f} Hz, the settings say {wanted_hz:g}"
    return Check("rate", passed, told)


def losses_check(counts: StreamStatistics) -> Check:
    """Judge what never came; what came twice or late was put right."""
    told = f"{counts.lost} lost of {counts.received + counts.lost}"
    for name in ("duplicated", "late", "malformed", "restarts"):
        if number := getattr(counts, name):
            told += f", {number} {name}"
    return Check("losses", not (counts.lost or counts.malformed or counts.restarts), told)
