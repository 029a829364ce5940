"""Cyclic garbage is collected on the interface thread alone."""

import gc
import threading
import weakref
from collections.abc import Iterator

import pytest
from pytestqt.qtbot import QtBot

from gui.collector import Collector


class Loop:
    """Garbage that only the collector finds; notes the thread on which it ends."""

    def __init__(self, ended_on: list[int]) -> None:
        self.itself = self
        weakref.finalize(self, lambda: ended_on.append(threading.get_ident()))


@pytest.fixture
def collecting() -> Iterator[None]:
    """As Python starts."""
    gc.enable()
    yield
    gc.disable()


def allocate_beside() -> list[list[int]]:
    """On a thread beside this one, allocate more than makes Python collect; returns it."""
    kept: list[list[int]] = []
    thread = threading.Thread(target=lambda: kept.extend([] for _ in range(3 * gc.get_threshold()[0])))
    thread.start()
    thread.join()
    return kept


def test_garbage_ends_on_the_interface_thread_whoever_allocates(collecting: None, qtbot: QtBot) -> None:
    collector = Collector()
    ended_on: list[int] = []
    Loop(ended_on)
    kept = allocate_beside()
    assert kept
    assert not ended_on
    qtbot.waitUntil(lambda: bool(ended_on))
    assert ended_on == [threading.get_ident()]
    collector.end()


def test_without_it_the_thread_beside_collects(collecting: None) -> None:
    gc.collect()
    ended_on: list[int] = []
    Loop(ended_on)
    assert allocate_beside()
    assert ended_on
    assert ended_on != [threading.get_ident()]


def test_collecting_is_as_it_was_afterwards(collecting: None, qtbot: QtBot) -> None:
    Collector().end()
    assert gc.isenabled()
    gc.disable()
    Collector().end()
    assert not gc.isenabled()
