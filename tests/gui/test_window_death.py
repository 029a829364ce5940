import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from session_endings import stop_of, wait_until_sealed

from daq.recording.folder import read_info, verify_checksums
from daq.recording.reader import Recording
from daq.virtual_rig.layout import REST_TOOL
from robot_drivers.clock import host_time_s

PROGRAM = Path(__file__).with_name("window_program.py")


@contextmanager
def recording_window(rig_path: Path, sessions: Path) -> Iterator[tuple[subprocess.Popen[str], Path]]:
    """A window in a process of its own that has begun its first step; with it the folder of its session."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    command = [sys.executable, str(PROGRAM), str(rig_path), str(sessions)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as window:
        assert window.stdout is not None
        folder = Path(window.stdout.readline().strip())
        try:
            yield window, folder
        finally:
            window.kill()


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        (signal.SIGKILL, "the controlling program"),
        (signal.SIGUSR1, "the controlling program has been silent"),
    ],
    ids=["killed", "interface frozen"],
)
def test_a_window_that_dies_or_freezes_leaves_the_robot_held_and_the_recording_whole(
    rig_path: Path, tmp_path: Path, kind: signal.Signals, told: str
) -> None:
    with recording_window(rig_path, tmp_path / "sessions") as (window, folder):
        assert folder.is_dir()
        time.sleep(0.3)
        struck_s = host_time_s()
        window.send_signal(kind)
        wait_until_sealed(folder, 40.0)
    reason, stood_s = stop_of(folder)
    assert told in reason
    assert stood_s - struck_s < 3.0  # the limit is a second; the machine may be busy
    assert read_info(folder).state == "sealed"
    assert verify_checksums(folder) == []
    recording = Recording(folder)
    assert recording.force.host_time_ns[-1] * 1e-9 > stood_s
    assert recording.robot.position[-1][0] - REST_TOOL.position[0] < 0.003
