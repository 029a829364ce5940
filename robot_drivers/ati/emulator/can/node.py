"""What emulated sensors on a CAN bus share: a thread that answers requests, and answers that go astray."""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import can
import numpy as np

Frames = list[tuple[int, bytes]]
"""Identifiers and data of the frames of one answer."""

_POLL_S = 0.02


class CanNode:
    """A device on a bus of python-can; it answers from construction until :meth:`close`.

    Parameters
    ----------
    channel, interface : of python-can
    name : of the thread
    answer : called with every frame of the bus, and with None now and then while it is silent; the thread sends what
        it returns
    """

    def __init__(
        self, channel: str, interface: str, name: str, answer: Callable[[can.Message | None], Frames]
    ) -> None:
        self._answer = answer
        self._bus = can.Bus(channel=channel, interface=interface)
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._serve, name=name)
        self._thread.start()

    def close(self) -> None:
        """Leave the bus; once is enough."""
        if not self._closing.is_set():
            self._closing.set()
            self._thread.join()
            self._bus.shutdown()

    def _serve(self) -> None:
        while not self._closing.is_set():
            for identifier, data in self._answer(self._bus.recv(_POLL_S)):
                self._bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))


@dataclass(slots=True)
class AnswerCounts:
    """Requests for samples, those left without a whole answer, and the frames that were cut short."""

    requests: int = 0
    unanswered: int = 0
    cut: int = 0


class AnswerFaults(Protocol):
    """Probability for each answer to be missing, to lack its last frame, or to have a first frame cut short."""

    @property
    def silence(self) -> float:
        """Of a missing answer."""

    @property
    def halving(self) -> float:
        """Of a missing last frame."""

    @property
    def cutting(self) -> float:
        """Of a first frame cut short."""


def astray(answer: Frames, faults: AnswerFaults, random: np.random.Generator, counts: AnswerCounts) -> Frames:
    """Return what becomes of an answer under way, and count it."""
    silent, halved, cut = random.random(3) < (faults.silence, faults.halving, faults.cutting)
    counts.requests += 1
    counts.unanswered += bool(silent or halved or cut)
    if silent:
        return []
    if cut:
        counts.cut += 1
        (identifier, data), *rest = answer
        return [(identifier, data[:-1]), *rest]
    return answer[:-1] if halved else answer
