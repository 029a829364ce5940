"""A command and whatever it has started end together, however it is ended."""

import os
import signal
import sys
from pathlib import Path

import pytest
from process_tree import running
from session_endings import wait_until_sealed

from daq.recording.folder import read_info, verify_checksums

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="processes are looked up in /proc")

GONE_S = 60.0  # of which a busy machine needs most

STUDY = ["study", "table3", "--draws", "2", "--workers", "2"]
MAKING = ["benchmark", "make", "--seed", "3", "--out", "cases", "--cases", "4", "--processes", "2", "--quick"]
# each with how many processes it has when it is at work
COMMANDS = [
    pytest.param(["emulate", "netft", "--port", "0"], 1, id="emulate"),
    pytest.param(STUDY, 4, id="study"),
    pytest.param(MAKING, 4, id="benchmark make"),
    pytest.param(["faults", "--runs", "1", "--only", "window killed"], 5, id="faults"),
    pytest.param(["gui", "--virtual"], 2, id="the window's opening"),
    pytest.param(["gui", "--virtual"], 6, id="window"),
]
# What works through a pool of workers, and what has the window's own processes: they notice in different ways.
KILLED = [COMMANDS[1], COMMANDS[-1]]
HOW = [
    pytest.param(signal.SIGKILL, False, id="killed"),
    pytest.param(signal.SIGHUP, True, id="terminal closed"),
]


def strike(process_id: int, number: signal.Signals, group: bool) -> None:
    (os.killpg if group else os.kill)(process_id, number)


@pytest.mark.parametrize(("command", "processes"), COMMANDS)
def test_nothing_outlives_a_command_that_is_told_to_end(
    command: list[str], processes: int, tmp_path: Path
) -> None:
    end(command, processes, signal.SIGTERM, tmp_path)


@pytest.mark.parametrize(("command", "processes"), KILLED)
def test_nothing_outlives_a_command_that_is_killed(
    command: list[str], processes: int, tmp_path: Path
) -> None:
    end(command, processes, signal.SIGKILL, tmp_path)


def end(command: list[str], processes: int, number: signal.Signals, folder: Path) -> None:
    """Start a command, wait until it is at work, end it, and see that nothing of it is left."""
    with running(["daq.cli", *command], folder) as tree:
        tree.wait_until(lambda: len(tree.members()) >= processes, 120.0, f"{processes} processes")
        tree.first.send_signal(number)
        tree.wait_until_gone(GONE_S)
        said = tree.said()
        # of a worker that had not begun yet the interpreter's own words remain
        assert said.count("Traceback") == said.count("EOFError: Ran out of input")


@pytest.mark.parametrize(("number", "group"), HOW)
def test_a_session_is_sealed_however_its_command_ends(
    number: signal.Signals, group: bool, tmp_path: Path
) -> None:
    session = tmp_path / "session"
    with running(["daq.cli", "record", "virtual", "--output", str(session)], tmp_path) as tree:
        tree.wait_until(
            lambda: "step 1" in tree.said() or (session / "CHECKSUMS.sha256").exists(), 120.0, "first step"
        )
        strike(tree.first.pid, number, group)
        tree.wait_until_gone(GONE_S)
        said, status = tree.said(), tree.first.wait()
    wait_until_sealed(session, 1.0)
    assert verify_checksums(session) == []
    assert "Traceback" not in said
    if number != signal.SIGKILL:
        assert status == 128 + signal.SIGTERM
        assert "the robot is held, the recording is sealed" in said
        assert [problem for problem in read_info(session).problems if "could not be held" in problem] == []


def test_who_wants_a_closed_terminal_ignored_has_it_ignored(tmp_path: Path) -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with running(["daq.cli", "emulate", "netft", "--port", "0"], tmp_path) as tree:
            tree.wait_until(lambda: "Ctrl-C ends it" in tree.said(), 60.0, "emulator")
            tree.first.send_signal(signal.SIGHUP)
            with pytest.raises(AssertionError, match="still there"):
                tree.wait_until_gone(1.0)
    finally:
        signal.signal(signal.SIGHUP, before)
