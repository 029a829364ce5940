"""A slow client is not a silent one; a silent one is told in time, however it fell silent."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from daq.acquisition.silence import LIMIT_S, LONGEST_S, Silence, processor_time

PERIOD_S = 0.05
INTERFACE, LINK = 7, 8


class Computer:
    """A clock, and threads that run, sleep or wait for a processor as a test wants it."""

    def __init__(self) -> None:
        self.now_s = 1000.0
        self.used_s = {INTERFACE: 0.0, LINK: 0.0}
        self.delayed_s = {INTERFACE: 0.0, LINK: 0.0}
        self.runnable = {INTERFACE: False, LINK: False}
        self.silence = self.watched_by(waiting_is_excused=True)
        self.silence.heard((INTERFACE, LINK))

    def watched_by(self, waiting_is_excused: bool) -> Silence:
        return Silence(
            PERIOD_S,
            lambda: self.now_s,
            waiting_is_excused=waiting_is_excused,
            processor_time=self.processor_time,
        )

    def processor_time(self, thread: int) -> tuple[float, float, bool] | None:
        if thread not in self.used_s:
            return None
        return self.used_s[thread], self.delayed_s[thread], self.runnable[thread]

    def silent_after_s(
        self, longest_s: float = 10.0, step_s: float = PERIOD_S, **each: dict[int, float]
    ) -> float:
        """Let time pass until the client is called silent; how long that took, infinite where it does not."""
        begun_s = self.now_s
        while self.now_s - begun_s < longest_s:
            self.now_s += step_s
            for thread, share in each.get("delayed", {}).items():
                self.delayed_s[thread] += share * step_s
            for thread, share in each.get("used", {}).items():
                self.used_s[thread] += share * step_s
            if self.silence.look():
                return self.now_s - begun_s
        return float("inf")


@pytest.fixture
def computer() -> Computer:
    return Computer()


@pytest.mark.parametrize("waited", [{}, {INTERFACE: 1.0}], ids=["frozen", "waits for a processor"])
def test_on_a_real_rig_no_reason_excuses_a_client(computer: Computer, waited: dict[int, float]) -> None:
    computer.silence = computer.watched_by(waiting_is_excused=False)
    computer.silence.heard((INTERFACE, LINK))
    assert computer.silent_after_s(delayed=waited) == pytest.approx(LIMIT_S, abs=1.5 * PERIOD_S)


def test_on_a_real_rig_a_watch_that_comes_late_does_not_excuse_it_either(computer: Computer) -> None:
    computer.silence = computer.watched_by(waiting_is_excused=False)
    computer.silence.heard((INTERFACE, LINK))
    computer.now_s += 1.5 * LIMIT_S
    assert computer.silence.look().startswith("the controlling program has been silent for 1.2")


def test_a_frozen_client_is_silent_after_the_limit(computer: Computer) -> None:
    assert computer.silent_after_s() == pytest.approx(LIMIT_S, abs=1.5 * PERIOD_S)
    assert computer.silence.look().startswith("the controlling program has been silent for 0.8")


def test_a_client_that_computes_without_an_end_is_silent_after_the_limit(computer: Computer) -> None:
    computer.runnable[INTERFACE] = True
    assert computer.silent_after_s(used={INTERFACE: 1.0}) == pytest.approx(LIMIT_S, abs=1.5 * PERIOD_S)


@pytest.mark.parametrize("thread", [INTERFACE, LINK])
def test_a_client_that_waits_for_a_processor_is_not_silent(computer: Computer, thread: int) -> None:
    slow = {"delayed": {thread: 0.8}, "used": {thread: 0.2}}
    assert computer.silent_after_s(longest_s=1.9, **slow) == float("inf")


def test_a_wait_that_has_not_ended_counts_too(computer: Computer) -> None:
    computer.runnable[INTERFACE] = True
    assert computer.silent_after_s(longest_s=1.9) == float("inf")


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 1.0])
def test_no_wait_whatever_excuses_a_client_for_longer_than_the_longest(
    computer: Computer, share: float
) -> None:
    waited_s = computer.silent_after_s(delayed={INTERFACE: share})
    assert LIMIT_S <= waited_s <= LONGEST_S + 1.5 * PERIOD_S


@pytest.mark.parametrize("told", [(), (INTERFACE, LINK)], ids=["unknown", "known"])
def test_a_watch_that_comes_late_itself_does_not_blame_the_client_for_it(
    computer: Computer, told: tuple[int, ...]
) -> None:
    computer.silence = computer.watched_by(waiting_is_excused=True)
    computer.silence.heard(told)
    computer.now_s += 1.5 * LIMIT_S
    assert computer.silence.look() == ""


def test_a_frozen_client_is_silent_after_the_limit_although_the_watch_comes_late(computer: Computer) -> None:
    late_s = 0.3
    assert computer.silent_after_s(step_s=late_s) <= LIMIT_S + 2 * late_s


def test_what_a_client_waited_before_it_spoke_is_no_excuse_later(computer: Computer) -> None:
    computer.silent_after_s(longest_s=1.5, delayed={INTERFACE: 1.0})
    computer.silence.heard((INTERFACE, LINK))
    assert computer.silent_after_s() == pytest.approx(LIMIT_S, abs=1.5 * PERIOD_S)


def test_a_client_that_does_not_tell_its_threads_is_judged_by_the_clock(computer: Computer) -> None:
    computer.silence = computer.watched_by(waiting_is_excused=True)
    assert computer.silent_after_s(delayed={INTERFACE: 1.0}) == pytest.approx(LIMIT_S, abs=1.5 * PERIOD_S)


def test_as_long_as_it_speaks_it_is_not_silent(computer: Computer) -> None:
    for _ in range(100):
        computer.now_s += LIMIT_S - PERIOD_S
        computer.silence.look()
        computer.silence.heard()
    assert computer.silence.look() == ""


@pytest.fixture
def stopped_process() -> Iterator[int]:
    with subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"]) as process:
        process.send_signal(signal.SIGSTOP)
        deadline = time.monotonic() + 60.0
        while Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()[0] != "T":
            assert time.monotonic() < deadline
            time.sleep(0.01)
        yield process.pid
        process.kill()


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel of Linux tells")
def test_a_stopped_process_waits_for_no_processor(stopped_process: int) -> None:
    before = processor_time(stopped_process)
    time.sleep(0.3)
    after = processor_time(stopped_process)
    assert before is not None
    assert after is not None
    assert after[1] == before[1]
    assert not after[2]


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel of Linux tells")
def test_threads_that_share_one_processor_wait_for_it() -> None:
    allowed = os.sched_getaffinity(0)
    program = (
        "import os, sys, threading, time\n"
        f"os.sched_setaffinity(0, {{{min(allowed)}}})\n"
        "os.fork()\n"
        "end = time.monotonic() + 2.0\n"
        "while time.monotonic() < end: pass\n"
    )
    with subprocess.Popen([sys.executable, "-c", program]) as process:
        time.sleep(1.5)
        told = processor_time(process.pid)
    assert told is not None
    assert told[1] > 0.1


def test_a_thread_that_is_gone_is_not_told() -> None:
    thread = threading.Thread(target=int)
    thread.start()
    thread.join()
    assert thread.native_id is not None
    deadline = time.monotonic() + 10.0
    # the kernel may still be at it when Python has joined it
    while processor_time(thread.native_id) is not None and time.monotonic() < deadline:
        time.sleep(0.01)
    assert processor_time(thread.native_id) is None
