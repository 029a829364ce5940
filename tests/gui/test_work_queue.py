from dataclasses import replace
from pathlib import Path

import pytest

from daq.errors import RecordingError
from daq.plans import Trial
from gui.recording.work_queue import (
    Entry,
    changed,
    moved,
    next_place,
    read_queue,
    repeated,
    with_trial,
    without,
    write_queue,
)

PULL, TWIST = Trial("pull", steps=3, holds_s=(3.0, 8.0), notes="dry"), Trial("twist_and_pull")


def test_each_repetition_is_an_entry_of_its_own() -> None:
    queue = with_trial((), replace(PULL, repeat=3))
    assert [entry.trial for entry in queue] == [PULL] * 3


def test_entries_can_be_moved_repeated_and_taken_out_but_not_while_they_run() -> None:
    queue = with_trial(with_trial((), PULL), TWIST)
    assert [entry.trial for entry in moved(queue, 1, -1)] == [TWIST, PULL]
    assert moved(queue, 0, -1) == queue
    assert [entry.trial for entry in repeated(queue, 0)] == [PULL, PULL, TWIST]
    assert without(queue, [0]) == queue[1:]
    running = changed(queue, 0, replace(queue[0], state="running"))
    assert without(running, [0, 1]) == running[:1]


def test_a_day_is_resumed_with_the_first_entry_that_waits(tmp_path: Path) -> None:
    done = Entry(PULL, "done", Path("sessions/a"))
    queue = (done, Entry(TWIST, "running", Path("sessions/b")), Entry(PULL))
    write_queue(queue, tmp_path / "queue.json")
    resumed = read_queue(tmp_path / "queue.json")
    assert (resumed[0], resumed[2]) == (done, Entry(PULL))
    assert (resumed[1].state, resumed[1].remark) == ("stopped", "the window was closed while it ran")
    assert next_place(resumed) == 2
    assert read_queue(tmp_path / "none.json") == ()


@pytest.mark.parametrize(
    "text",
    ['[{"trial": {"angle": 1}}]', "3", '["a"]', "[" * 100_000, "\0", '[{"trial": [], "state": "done"}]'],
)
def test_a_file_that_holds_no_queue_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "queue.json"
    path.write_text(text)
    with pytest.raises(RecordingError, match=r"queue\.json: holds no queue"):
        read_queue(path)


def test_an_entry_in_a_state_that_there_is_none_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "queue.json"
    write_queue((Entry(PULL, "done"),), path)
    path.write_text(path.read_text().replace('"done"', '"nearly done"'))
    with pytest.raises(RecordingError, match="nearly done"):
        read_queue(path)
