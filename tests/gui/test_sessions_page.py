"""The Sessions page: the list with its filter, and repair, replay and export of what is looked at."""

import fcntl
import shutil
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from pytestqt.qtbot import QtBot
from stand_in_jobs import StandInJobs, without_processes
from synthetic_session import SyntheticSession

from daq.errors import RecordingError
from daq.recording.folder import read_info, seal_session
from daq.recording.in_use import locked
from daq.recording.reader import Recording
from daq.recording.recovery import recover_session
from daq.virtual_rig.layout import GRASP_CENTRE, placed_beads
from daq.virtual_rig.physics.phantom import SpringPhantom
from gui.analysis.computations import export_session, judge_session, repair_session
from gui.analysis.following import FollowedStep, follow_session
from gui.context import Context
from gui.jobs.process import Progressed, Reporter, Shown
from gui.messages import Message
from gui.pages.sessions import SessionsPage
from gui.sessions.playback import open_playback
from gui.sessions.session_list import SessionEntry, entry_of, find_sessions, matching
from gui.widgets.forms.session_table import SessionTable
from gui.widgets.video.replay_pane import ReplayPane
from robot_drivers.protocols import Pose

POSES = tuple(Pose((0.04 + way, 0.0, 0.0)) for way in (0.0, 0.003))
PATIENCE_MS = 60_000
SILENT = Reporter(lambda message: None)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session that nobody has sealed."""
    folder = tmp_path_factory.mktemp("recorded") / "2026-05-04_143210_P1_pull"
    return SyntheticSession(POSES, SpringPhantom(GRASP_CENTRE, placed_beads(3)), frame_rate=3.0).write(folder)


@pytest.fixture
def sessions(context: Context, recorded: Path) -> Path:
    """A folder with a sealed session and one that was cut off."""
    shutil.copytree(recorded, context.sessions_folder / "sealed")
    seal_session(context.sessions_folder / "sealed", ("2 samples lost",))
    shutil.copytree(recorded, context.sessions_folder / "cut")
    return context.sessions_folder


@pytest.fixture
def jobs_and_page(
    context: Context, sessions: Path, qtbot: QtBot
) -> Iterator[tuple[StandInJobs, SessionsPage]]:
    changed, jobs = without_processes(context)
    page = SessionsPage(changed)
    qtbot.addWidget(page)
    page.show()
    qtbot.waitUntil(lambda: page.table.table.rowCount() == 2, timeout=PATIENCE_MS)
    yield jobs, page
    page.replay.end()


def look_at(page: SessionsPage, name: str) -> None:
    page.table.choose(page.table.folder / name)


def test_sessions_are_listed_with_their_state_and_filtered(sessions: Path) -> None:
    (sessions / "broken").mkdir()
    (sessions / "broken" / "session.json").write_text("{")
    entries = find_sessions(sessions)
    assert {entry.folder.name: entry.condition for entry in entries} == {
        "sealed": "sealed",
        "cut": "cut off",
        "broken": "unreadable",
    }
    assert [entry.folder.name for entry in matching(entries, "p1 TWIST", "cut off")] == ["cut"]
    assert [entry.folder.name for entry in matching(entries, "broken")] == ["broken"]
    assert matching(entries, "elsewhere") == ()
    assert find_sessions(sessions / "nowhere") == ()


def test_only_what_was_cut_off_can_be_repaired_and_only_what_is_sealed_used(
    jobs_and_page: tuple[StandInJobs, SessionsPage],
) -> None:
    _, page = jobs_and_page
    look_at(page, "cut")
    assert page.repair.isVisible()
    assert not page.estimate.isEnabled()
    look_at(page, "sealed")
    assert not page.repair.isVisible()
    assert page.estimate.isEnabled()


def test_what_is_being_sealed_is_not_to_be_repaired(
    sessions: Path, jobs_and_page: tuple[StandInJobs, SessionsPage], qtbot: QtBot
) -> None:
    """Its files are closed, and the process that recorded it still judges them."""
    _, page = jobs_and_page

    def condition() -> str:
        return "" if page.table.entry is None else page.table.entry.condition

    with locked(sessions / "cut" / "rig.toml"):
        look_at(page, "cut")
        qtbot.waitUntil(lambda: condition() == "sealing", timeout=PATIENCE_MS)
        assert not page.repair.isVisible()
        with pytest.raises(RecordingError, match="wait until that session has ended"):
            recover_session(sessions / "cut")
    assert entry_of(sessions / "cut").condition == "cut off"


def test_the_table_follows_the_filter(jobs_and_page: tuple[StandInJobs, SessionsPage]) -> None:
    _, page = jobs_and_page
    assert page.table.table.rowCount() == 2
    page.table.condition.setCurrentText("sealed")
    assert page.table.table.rowCount() == 1
    page.table.filter.setText("nothing like this")
    assert page.table.table.rowCount() == 0
    assert not page.export.isEnabled()


def test_the_window_goes_on_while_a_slow_disk_lists_its_sessions(
    sessions: Path, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = threading.Event()

    def find_slowly(folder: Path) -> tuple[SessionEntry, ...]:
        read.wait()
        return find_sessions(folder)

    monkeypatch.setattr("gui.sessions.session_finder.find_sessions", find_slowly)
    table = SessionTable(sessions)
    qtbot.addWidget(table)
    table.show()
    qtbot.wait(50)
    assert table.table.rowCount() == 0
    read.set()
    qtbot.waitUntil(lambda: table.table.rowCount() == 2, timeout=PATIENCE_MS)


def test_a_session_from_elsewhere_joins_the_list_and_stays(
    jobs_and_page: tuple[StandInJobs, SessionsPage], recorded: Path, qtbot: QtBot
) -> None:
    _, page = jobs_and_page
    page.table.choose(recorded)
    assert page.table.entry is not None
    assert page.table.entry.folder == recorded
    with qtbot.waitSignal(page.table.chosen, timeout=PATIENCE_MS):
        page.table.refresh()
    assert page.table.table.rowCount() == 3
    assert page.table.entry.folder == recorded


def test_a_repair_is_asked_for_and_told(
    jobs_and_page: tuple[StandInJobs, SessionsPage], context: Context, sessions: Path, qtbot: QtBot
) -> None:
    jobs, page = jobs_and_page
    told: list[Message] = []
    context.navigator.message_told.connect(told.append)
    look_at(page, "cut")
    page.repair.click()
    job = jobs.asked[0]
    assert (job.task, job.arguments) == (repair_session, (sessions / "cut",))
    job.finish(repair_session(SILENT, sessions / "cut"))
    assert read_info(sessions / "cut").state == "recovered"
    assert "cut is repaired" in told[0].what
    recovered = entry_of(sessions / "cut")
    assert recovered.condition == "recovered"
    qtbot.waitUntil(lambda: page.table.entry == recovered, timeout=PATIENCE_MS)
    assert "alignment" in page.quality.text() or "against the robot" in page.quality.text()


def test_an_export_is_asked_for_and_told(
    jobs_and_page: tuple[StandInJobs, SessionsPage], context: Context, sessions: Path, tmp_path: Path
) -> None:
    jobs, page = jobs_and_page
    told: list[Message] = []
    context.navigator.message_told.connect(told.append)
    target = tmp_path / "session.npz"
    page.export_to(sessions / "sealed", "npz", target)
    job = jobs.asked[0]
    assert (job.task, job.arguments) == (export_session, (sessions / "sealed", "npz", target))
    assert not page.export.isEnabled()
    job.finish(export_session(SILENT, sessions / "sealed", "npz", target))
    assert told[0].severity == "information"
    assert "session.npz" in told[0].what
    with np.load(target) as stored:
        np.testing.assert_array_equal(stored["force/fx"], Recording(sessions / "sealed").force.wrench[:, 0])


def test_an_experiment_folder_is_exported_too(sessions: Path, tmp_path: Path) -> None:
    told = export_session(SILENT, sessions / "sealed", "experiment", tmp_path / "experiment")
    assert told.startswith("2 synchronised rows")


def test_a_session_can_be_judged_anew(sessions: Path) -> None:
    report = judge_session(SILENT, sessions / "sealed")
    assert report.streams["force"].missing == 0


def test_estimate_and_diagnose_are_asked_of_their_pages(
    jobs_and_page: tuple[StandInJobs, SessionsPage], context: Context, sessions: Path
) -> None:
    _, page = jobs_and_page
    asked: list[object] = []
    context.navigator.estimate_requested.connect(asked.append)
    context.navigator.diagnose_requested.connect(asked.append)
    look_at(page, "sealed")
    page.estimate.click()
    page.diagnose.click()
    assert asked == [(sessions / "sealed",)] * 2


def test_at_an_instant_the_recording_shows_what_was_there(sessions: Path) -> None:
    playback, recording = open_playback(sessions / "sealed"), Recording(sessions / "sealed")
    assert playback.duration_s == pytest.approx(3.0, abs=0.05)
    late = playback.at(2.9, span_s=1.0)
    assert late.words == "step 1, measuring"
    assert late.force[-1, 0] - late.force[0, 0] == pytest.approx(1.0, abs=0.02)
    pulled = late.force[:, 1:].mean(axis=0) - playback.zero
    assert np.linalg.norm(pulled[:3]) > 0.2
    rest = playback.at(0.9, span_s=0.5).force[:, 1:].mean(axis=0) - playback.zero
    assert np.abs(rest[:3]).max() < 0.01
    images = recording.images("left")
    np.testing.assert_array_equal(late.images["left"], images.image(len(images) - 1)[::2, ::2])
    assert late.tool is not None
    assert late.tool[:3] == pytest.approx(recording.robot.position[-1], abs=1e-3)


def test_a_session_is_followed_while_it_is_recorded(sessions: Path) -> None:
    """Whoever records it has its file open until the follower waits for more."""
    told: list[object] = []
    waiting = Progressed("waiting for the next step", 0, 0)
    with (sessions / "cut" / "signals.mcap").open("rb") as in_use:
        fcntl.flock(in_use, fcntl.LOCK_EX)

        def hear(message: object) -> None:
            told.append(message)
            if message == waiting:
                fcntl.flock(in_use, fcntl.LOCK_UN)

        assert follow_session(Reporter(hear), sessions / "cut", patience_of_seal_s=0.1) is None
    shown = [message.value for message in told if isinstance(message, Shown)]
    assert [one.estimate.step for one in shown if isinstance(one, FollowedStep)] == [1]
    assert told[-1] == Progressed("waiting for the seal", 0, 0)


def test_a_replay_is_scrubbed_and_played_through_the_live_widgets(
    context: Context, sessions: Path, qtbot: QtBot
) -> None:
    pane = ReplayPane(context.rig)
    qtbot.addWidget(pane)
    pane.show()
    with qtbot.waitSignal(pane.opened, timeout=PATIENCE_MS):
        pane.open(sessions / "sealed")
    pane.seek(2.9)
    qtbot.waitUntil(lambda: pane.words.text() == "step 1, measuring", timeout=PATIENCE_MS)
    assert pane.clock.text() == "2.9 of 3.0 s"
    pane.play.click()
    qtbot.waitUntil(lambda: not pane.play.isChecked(), timeout=PATIENCE_MS)
    assert pane.slider.value() == pane.slider.maximum()
    pane.end()


def test_what_cannot_be_replayed_says_why(context: Context, sessions: Path, qtbot: QtBot) -> None:
    pane = ReplayPane(context.rig)
    qtbot.addWidget(pane)
    with qtbot.waitSignal(pane.failed, timeout=PATIENCE_MS) as blocker:
        pane.open(sessions / "nowhere")
    assert "nowhere" in blocker.args[0]
    assert not pane.play.isEnabled()
    pane.end()


def test_a_replay_that_is_asked_for_comes_to_the_front(
    jobs_and_page: tuple[StandInJobs, SessionsPage], context: Context, sessions: Path, qtbot: QtBot
) -> None:
    _, page = jobs_and_page
    with qtbot.waitSignal(page.replay.opened, timeout=PATIENCE_MS):
        context.navigator.replay_requested.emit(sessions / "sealed")
    assert page.tabs.currentWidget() is page.replay
