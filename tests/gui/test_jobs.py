import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from multiprocessing.process import BaseProcess
from pathlib import Path

import pytest
from job_tasks import clear_up_when_interrupted, count, ended, fail, wait_for_file
from PySide6.QtCore import QTimer
from pytestqt.qtbot import QtBot

from gui.jobs.running import Job, Jobs

PATIENCE_MS = 60_000
PROGRAM = [sys.executable, str(Path(__file__).with_name("job_program.py"))]
ENVIRONMENT = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}


@pytest.fixture
def jobs(qtbot: QtBot) -> Iterator[Jobs]:
    made = Jobs()
    yield made
    made.close()


def processes_of(job: Job, qtbot: QtBot) -> tuple[int, int]:
    with qtbot.waitSignal(job.shown, timeout=PATIENCE_MS) as blocker:
        pass
    first, second = blocker.args[0]
    return int(first), int(second)


def test_a_job_tells_progress_results_on_the_way_and_its_result_in_order(jobs: Jobs, qtbot: QtBot) -> None:
    job = jobs.start("counting", count, 3)
    told: list[object] = []
    job.progressed.connect(lambda *progress: told.append(progress))
    job.shown.connect(told.append)
    job.finished.connect(lambda result: told.append(f"finished {result}"))
    with qtbot.waitSignal(job.ended, timeout=PATIENCE_MS):
        assert jobs.running == (job,)
    assert told == [
        ("counting", 1, 3),
        1,
        ("counting", 2, 3),
        4,
        ("counting", 3, 3),
        9,
        "finished 3",
    ]
    assert jobs.running == ()


def test_an_expected_error_comes_as_one_line(jobs: Jobs, qtbot: QtBot) -> None:
    job = jobs.start("failing", fail)
    with qtbot.waitSignal(job.failed, timeout=PATIENCE_MS) as blocker:
        pass
    assert blocker.args == ["sessions/one: is being recorded; wait"]


def test_an_error_of_the_program_is_told_and_printed() -> None:
    ended = subprocess.run(PROGRAM, env=ENVIRONMENT, capture_output=True, text=True, check=True)
    assert "without a result (exit status 1)" in ended.stdout
    assert "ZeroDivisionError" in ended.stderr


def test_a_process_that_is_slow_to_start_does_not_hold_the_window_up(
    jobs: Jobs, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It starts only once the interface has gone on: the robot is held where that is silent."""
    gone_on, start = threading.Event(), BaseProcess.start

    def start_late(process: BaseProcess) -> None:
        assert gone_on.wait(PATIENCE_MS / 1000)
        start(process)

    monkeypatch.setattr(BaseProcess, "start", start_late)
    job = jobs.start("counting", count, 3)
    gone_on.set()
    with qtbot.waitSignal(job.finished, timeout=PATIENCE_MS) as blocker:
        pass
    assert blocker.args == [3]


def test_the_window_goes_on_while_a_job_runs(jobs: Jobs, qtbot: QtBot, tmp_path: Path) -> None:
    """The job ends only because the interface's timer went on."""
    sign = tmp_path / "go"

    def give_the_sign() -> None:
        sign.touch()

    job = jobs.start("waiting", wait_for_file, sign)
    job.progressed.connect(lambda *_: QTimer.singleShot(50, give_the_sign))
    with qtbot.waitSignal(job.finished, timeout=PATIENCE_MS) as blocker:
        pass
    assert blocker.args == ["seen"]


def test_a_cancelled_job_is_interrupted_and_its_workers_end_with_it(
    jobs: Jobs, qtbot: QtBot, tmp_path: Path
) -> None:
    job = jobs.start("for ever", clear_up_when_interrupted, tmp_path / "cleared")
    results: list[object] = []
    job.finished.connect(results.append)
    job.failed.connect(results.append)
    process, worker = processes_of(job, qtbot)
    with qtbot.waitSignal(job.cancelled, timeout=PATIENCE_MS):
        job.cancel()
    assert (tmp_path / "cleared").exists()
    assert results == []
    qtbot.waitUntil(ended(process), timeout=PATIENCE_MS)
    qtbot.waitUntil(ended(worker), timeout=PATIENCE_MS)


def test_closing_ends_every_job(qtbot: QtBot, tmp_path: Path) -> None:
    jobs = Jobs()
    job = jobs.start("for ever", clear_up_when_interrupted, tmp_path / "cleared")
    process, _ = processes_of(job, qtbot)
    jobs.close()
    assert jobs.running == ()
    assert ended(process)()


def test_a_killed_window_takes_its_jobs_along(qtbot: QtBot, tmp_path: Path) -> None:
    command = [*PROGRAM, str(tmp_path / "cleared")]
    with subprocess.Popen(command, env=ENVIRONMENT, stdout=subprocess.PIPE, text=True) as window:
        assert window.stdout is not None
        process, worker = map(int, window.stdout.readline().split())
        window.kill()
    qtbot.waitUntil(ended(process), timeout=PATIENCE_MS)
    qtbot.waitUntil(ended(worker), timeout=PATIENCE_MS)
