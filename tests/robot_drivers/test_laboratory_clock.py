"""The clock of an emulated laboratory: right in every process, never back, and standing while it is held."""

import multiprocessing
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_drivers.abb.emulator.controller import ControllerEmulator
from robot_drivers.abb.emulator.settings import EmulatorSettings
from robot_drivers.abb.irb140 import IRB140, IRB140Settings
from robot_drivers.clock import host_time_ns, host_times_ns, living_on, monotonic_time_ns, wait_until
from robot_drivers.errors import ConfigurationError, DeviceUnreachableError
from robot_drivers.laboratory_clock import ClockKeeper, LaboratoryClock

MS = 1_000_000
SECOND_NS = 1000 * MS


class Now:
    """The computer's clock in a test's hand."""

    def __init__(self) -> None:
        self.ns = 5000 * SECOND_NS

    def __call__(self) -> int:
        return self.ns


@pytest.fixture
def now(monkeypatch: pytest.MonkeyPatch) -> Now:
    now = Now()
    monkeypatch.setattr("robot_drivers.laboratory_clock.monotonic_time_ns", now)
    return now


@pytest.fixture
def keeper(tmp_path: Path, now: Now) -> ClockKeeper:
    return ClockKeeper(tmp_path / "clock")


def test_it_stands_until_time_is_granted_runs_to_its_end_and_stands_there(
    keeper: ClockKeeper, now: Now
) -> None:
    begun_ns = keeper.time_ns()
    now.ns += 7 * MS
    assert keeper.time_ns() == begun_ns
    keeper.grant(20 * MS)
    now.ns += 15 * MS
    assert keeper.time_ns() - begun_ns == 15 * MS
    now.ns += 15 * MS
    assert keeper.time_ns() - begun_ns == 20 * MS


def test_as_long_as_time_is_granted_in_time_it_runs_as_the_computers_clock_does(
    keeper: ClockKeeper, now: Now
) -> None:
    keeper.grant(20 * MS)
    begun_ns = keeper.time_ns()
    for _ in range(1000):
        now.ns += 19 * MS
        keeper.grant(20 * MS)
    assert keeper.time_ns() - begun_ns == 1000 * 19 * MS


GRANTS = st.lists(st.tuples(st.integers(0, 60 * MS), st.integers(0, 40 * MS)), min_size=1, max_size=400)


@given(grants=GRANTS)
def test_it_never_goes_back_nor_faster_than_the_computers_and_past_instants_are_told_as_they_were(
    tmp_path_factory: pytest.TempPathFactory, grants: list[tuple[int, int]]
) -> None:
    now = Now()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("robot_drivers.laboratory_clock.monotonic_time_ns", now)
        path = tmp_path_factory.mktemp("clock") / "clock"
        keeper, elsewhere = ClockKeeper(path), LaboratoryClock(path)
        instants, shown = [now.ns], [keeper.time_ns()]
        for waited_ns, ahead_ns in grants:
            now.ns += waited_ns
            keeper.grant(ahead_ns)
            instants.append(now.ns)
            shown.append(elsewhere.time_ns())
        steps, waits = np.diff(shown), np.diff(instants)
        assert np.all(steps >= 0)
        assert np.all(steps <= waits)
        last = slice(-100, None)
        np.testing.assert_array_equal(keeper.times_ns(np.array(instants[last])), shown[last])


def test_a_laboratory_whose_keeper_is_silent_goes_on_a_second_after_that_was_noticed(
    keeper: ClockKeeper, now: Now
) -> None:
    keeper.grant(20 * MS)
    begun_ns = keeper.time_ns()
    for _ in range(11):
        now.ns += SECOND_NS
        assert keeper.time_ns() - begun_ns == 20 * MS
    now.ns += SECOND_NS
    assert keeper.time_ns() - begun_ns == 20 * MS
    now.ns += SECOND_NS
    assert keeper.time_ns() - begun_ns == SECOND_NS + 20 * MS


def test_a_computer_that_stood_still_as_a_whole_is_no_dead_laboratory(tmp_path: Path, now: Now) -> None:
    keeper = ClockKeeper(tmp_path / "clock")
    recorder = LaboratoryClock(tmp_path / "clock")
    reader = recorder.reader()
    for _ in range(3):
        keeper.grant(20 * MS)
        begun_ns = keeper.time_ns()
        now.ns += 60 * SECOND_NS
        assert recorder.time_ns() - begun_ns == 20 * MS
        assert keeper.readers_behind_s() == pytest.approx(20e-3)
        keeper.hold()
        now.ns += 500 * MS
        assert keeper.readers_behind_s() == pytest.approx(20e-3)
        reader.caught_up(recorder.time_ns())
        assert keeper.readers_behind_s() == 0.0


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="this system does not tell so of processes")
def test_a_laboratory_whose_keepers_process_has_ended_goes_on_after_one(tmp_path: Path, now: Now) -> None:
    program = (
        "import sys; from pathlib import Path; from robot_drivers.laboratory_clock import ClockKeeper; "
        "ClockKeeper(Path(sys.argv[1])).grant(20_000_000); print('keeps', flush=True); sys.stdin.read()"
    )
    command = [sys.executable, "-c", program, str(tmp_path / "clock")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as keeping:
        assert keeping.stdout is not None
        assert keeping.stdout.readline() == b"keeps\n"
        clock = LaboratoryClock(tmp_path / "clock")
        heard_ns = now.ns = time.monotonic_ns()
        stands_ns = clock.time_ns()
        now.ns = heard_ns + 5 * SECOND_NS
        assert clock.time_ns() - stands_ns <= 20 * MS
        keeping.kill()
    # it was heard a moment before the test looked
    assert clock.time_ns() - stands_ns == pytest.approx(4 * SECOND_NS, abs=SECOND_NS)


def test_a_keeper_that_comes_back_takes_it_on_from_where_it_went_by_itself(
    keeper: ClockKeeper, now: Now
) -> None:
    begun_ns = keeper.time_ns()
    now.ns += 11 * SECOND_NS
    assert keeper.time_ns() == begun_ns
    now.ns += 3 * SECOND_NS
    assert keeper.time_ns() - begun_ns == 2 * SECOND_NS
    for _ in range(3):
        keeper.hold()
        now.ns += SECOND_NS
        assert keeper.time_ns() - begun_ns == 2 * SECOND_NS
    keeper.grant(20 * MS)
    now.ns += SECOND_NS
    assert keeper.time_ns() - begun_ns == 2 * SECOND_NS + 20 * MS


def test_a_keeper_that_holds_it_has_not_died(keeper: ClockKeeper, now: Now) -> None:
    begun_ns = keeper.time_ns()
    for _ in range(60):
        now.ns += SECOND_NS
        keeper.hold()
    assert keeper.time_ns() == begun_ns


def test_a_reader_that_is_late_is_known_and_one_that_has_gone_or_died_is_not_waited_for(
    keeper: ClockKeeper, now: Now
) -> None:
    assert keeper.readers_behind_s() == 0.0
    readers = [keeper.reader() for _ in range(2)]
    begun_ns = keeper.time_ns()
    keeper.grant(SECOND_NS)
    now.ns += 200 * MS
    readers[0].caught_up(begun_ns + 190 * MS)
    assert keeper.readers_behind_s() == pytest.approx(0.2)
    readers[1].close()
    assert keeper.readers_behind_s() == pytest.approx(0.01)
    now.ns += 9 * SECOND_NS
    assert keeper.readers_behind_s() > 0.0
    now.ns += 2 * SECOND_NS
    assert keeper.readers_behind_s() > 0.0
    now.ns += 2 * SECOND_NS
    assert keeper.readers_behind_s() == 0.0


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="this system does not tell so of processes")
def test_a_reader_whose_process_has_ended_is_not_waited_for(tmp_path: Path) -> None:
    keeper = ClockKeeper(tmp_path / "clock")
    program = (
        "import sys; from pathlib import Path; from robot_drivers.laboratory_clock import LaboratoryClock; "
        "LaboratoryClock(Path(sys.argv[1])).reader(); print('reads', flush=True); sys.stdin.read()"
    )
    command = [sys.executable, "-c", program, str(tmp_path / "clock")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as reading:
        assert reading.stdout is not None
        assert reading.stdout.readline() == b"reads\n"
        keeper.grant(SECOND_NS)
        time.sleep(0.05)
        assert keeper.readers_behind_s() > 0.0
        reading.kill()
        deadline = time.monotonic() + 30.0
        while keeper.readers_behind_s() > 0.0 and time.monotonic() < deadline:
            time.sleep(0.01)
    assert keeper.readers_behind_s() == 0.0


def test_any_number_of_readers_can_come_one_after_the_other(keeper: ClockKeeper) -> None:
    for _ in range(100):
        readers = [keeper.reader() for _ in range(20)]
        for reader in readers:
            reader.close()
    assert keeper.readers_behind_s() == 0.0


@pytest.mark.parametrize("content", [b"", b"short", b"\0" * 100_000], ids=["empty", "short", "other"])
def test_another_file_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "clock"
    path.write_bytes(content)
    with pytest.raises(ConfigurationError, match="no clock of an emulated laboratory"):
        LaboratoryClock(path)


def test_a_laboratory_that_has_ended_is_told(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="has ended, start it anew"):
        LaboratoryClock(tmp_path / "clock")


def _tell_time(path: Path, answers: Connection) -> None:
    with living_on(LaboratoryClock(path)):
        while answers.recv():
            answers.send(host_time_ns())


@pytest.fixture
def other_process(tmp_path: Path) -> Iterator[tuple[ClockKeeper, Connection]]:
    keeper = ClockKeeper(tmp_path / "clock")
    ours, theirs = multiprocessing.get_context("spawn").Pipe()
    process = multiprocessing.get_context("spawn").Process(
        target=_tell_time, args=(tmp_path / "clock", theirs)
    )
    process.start()
    yield keeper, ours
    ours.send(False)
    process.join()


def test_all_processes_of_a_laboratory_see_the_same_time(
    other_process: tuple[ClockKeeper, Connection],
) -> None:
    keeper, other = other_process
    for _ in range(20):
        keeper.grant(2 * MS)
        before_ns = keeper.time_ns()
        other.send(True)
        theirs_ns = other.recv()
        assert before_ns <= theirs_ns <= keeper.time_ns()


def test_who_lives_on_it_waits_in_its_time_and_stamps_in_its_time(tmp_path: Path) -> None:
    keeper = ClockKeeper(tmp_path / "clock")
    ahead_ns = host_time_ns() - keeper.time_ns()
    with living_on(keeper):
        begun_ns = host_time_ns()
        time.sleep(0.01)
        assert host_time_ns() == begun_ns
        keeper.grant(20 * MS)
        wait_until(begun_ns + 10 * MS)
        assert host_time_ns() >= begun_ns + 10 * MS
        instant_ns = monotonic_time_ns()
        assert host_times_ns(np.array([instant_ns]))[0] <= host_time_ns()
    assert host_time_ns() - keeper.time_ns() > ahead_ns


def test_an_emulated_controller_waits_for_the_heartbeat_of_its_client(tmp_path: Path) -> None:
    with ControllerEmulator(EmulatorSettings()) as emulator:
        keeper = ClockKeeper(tmp_path / "clock")
        with living_on(keeper):
            keeper.grant(60 * SECOND_NS)
            settings = IRB140Settings("127.0.0.1", emulator.command_port, emulator.state_port, egm=None)
            robot = IRB140(settings)
            robot.connect()
            behind_s = []
            for _ in range(20):
                time.sleep(0.02)
                behind_s.append(keeper.readers_behind_s())
            robot.close()
            assert all(behind_s), "somebody reads, and has never come as far as now"
            # of a heartbeat ten times a second
            assert min(behind_s) < 0.1
            assert keeper.readers_behind_s() == 0.0


def test_time_waits_for_the_client_of_a_controller_from_before_it_connects(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    keeper = ClockKeeper(tmp_path / "clock")
    behind_s = []

    def connect_late(*_: object, **__: object) -> socket.socket:
        time.sleep(0.05)
        behind_s.append(keeper.readers_behind_s())
        raise OSError("nobody there")

    monkeypatch.setattr(socket, "create_connection", connect_late)
    with living_on(keeper):
        keeper.grant(60 * SECOND_NS)
        with pytest.raises(DeviceUnreachableError):
            IRB140(IRB140Settings("127.0.0.1", 1, 2, egm=None)).connect()
        assert behind_s[0] >= 0.05
        assert keeper.readers_behind_s() == 0.0
