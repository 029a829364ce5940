"""A problem of the recording is told once, by what it is, and stands on the session in the list."""

from dataclasses import replace
from pathlib import Path

import pytest

from daq.recording.folder import SessionInfo
from gui.context import Context
from gui.messages import Message, recorded_told
from gui.recording.watch import RecordingWatch
from gui.rig.state import RigState
from gui.sessions.session_list import SessionEntry
from gui.widgets.forms.session_table import texts_of
from gui.widgets.rig.rig_bar import RigBar

FIRST, SECOND = Path("sessions/a"), Path("sessions/b")


def recording(session: Path, *problems: str) -> RigState:
    return RigState(phase="running", session=session, problems=problems)


@pytest.fixture
def told(context: Context) -> list[Message]:
    """What the operator is told."""
    messages: list[Message] = []
    context.navigator.message_told.connect(messages.append)
    return messages


def test_each_kind_of_problem_is_told_once_in_a_session(context: Context, told: list[Message]) -> None:
    watch = RecordingWatch(context)
    for lost in (3, 17, 942):
        context.link.state_changed.emit(recording(FIRST, f"force sensor: {lost} samples lost on the way"))
    assert [message.severity for message in told] == ["warning"]
    assert "force sensor: 3 samples lost on the way" in told[0].what
    lost, dropped = "force sensor: 942 samples lost on the way", "camera/left: 4 samples not written"
    context.link.state_changed.emit(recording(FIRST, lost, dropped))
    assert dropped in told[-1].what
    context.link.state_changed.emit(recording(SECOND, lost))
    assert len(told) == 3
    watch.deleteLater()


def test_what_happened_before_a_session_is_no_problem_of_it(context: Context, told: list[Message]) -> None:
    watch = RecordingWatch(context)
    context.link.state_changed.emit(
        replace(recording(FIRST, "robot: 3 samples lost on the way"), session=None)
    )
    assert told == []
    watch.deleteLater()


def test_a_session_that_is_marked_is_told_and_listed_with_what_it_is_marked_with() -> None:
    problems = ("force sensor: 12 samples lost on the way", "camera/left: 4 samples not written")
    message = recorded_told(
        "pull_1", problems, ["the emulated laboratory ran 1.8 times slower than real time"]
    )
    assert message.severity == "warning"
    assert all(problem in message.what for problem in problems)
    assert "1.8 times slower" in message.what
    info = SessionInfo("pull_1", "P1", 1, state="sealed", problems=problems)
    state = texts_of(SessionEntry(FIRST, info, "sealed"))[-1]
    assert state == f"sealed ⚠ {problems[0]}; {problems[1]}"


def test_a_flawless_session_is_told_without_a_warning() -> None:
    message = recorded_told("pull_1", (), [])
    assert (message.severity, message.what) == ("information", "pull_1 is recorded and sealed.")
    assert (
        texts_of(SessionEntry(FIRST, SessionInfo("pull_1", "P1", 1, state="sealed"), "sealed"))[-1]
        == "sealed"
    )


def test_the_bar_says_which_problem_the_recording_has(context: Context) -> None:
    bar = RigBar(context.rig.limits)
    problem = "force sensor: 942 samples lost on the way"
    bar.show_state(recording(FIRST, problem))
    assert bar.problems.toolTip() == problem
    assert bar.problems.text().startswith("⚠ force sensor")
    bar.show_state(recording(SECOND))
    assert bar.problems.text() == "no problem so far"
    bar.deleteLater()
