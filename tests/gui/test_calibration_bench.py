import os
import threading
from pathlib import Path

import pytest
from job_tasks import tells_its_priority
from pytestqt.qtbot import QtBot
from shiboken6 import delete

from daq.calibration_files.record import read_record
from daq.errors import CalibrationError
from daq.virtual_rig.layout import FRAMES, Addresses, rig_description
from daq.virtual_rig.operator import TOUCHES, touching_pose
from daq.vision.charuco import CharucoBoard
from gui.calibration.bench import Begin, CalibrationBench, Finish, Judged, Keep, Kept, TakeTouch, TouchTaken
from gui.jobs.companion import Companion
from gui.jobs.process import Failed
from gui.widgets.results.outcome_panel import OutcomePanel

RIG = rig_description(Addresses(1, 2, 3, 4, 5, 6, ("tcp://a", "tcp://b")), Path("stereo.toml"))


def touched(count: int) -> CalibrationBench:
    bench = CalibrationBench()
    bench(Begin(RIG, CharucoBoard()))
    for number in range(count):
        taken = bench(TakeTouch(touching_pose(number)))
        assert isinstance(taken, TouchTaken)
        assert taken.figures.touches == number + 1
    return bench


def test_a_calibration_is_collected_judged_and_kept(tmp_path: Path) -> None:
    bench = touched(TOUCHES)
    judged = bench(Finish("tool"))
    assert isinstance(judged, Judged)
    assert judged.acceptable
    assert judged.plot.startswith(b"\x89PNG")
    kept = bench(Keep(tmp_path, RIG.name, {"robot": "140-1"}, accepted=True))
    assert isinstance(kept, Kept)
    record = read_record(kept.path)
    assert (record.kind, record.verdict) == ("tool", "accepted")
    expected = FRAMES.T_tool_gripper.position_m
    assert record.result.gripper_in_tool_m == pytest.approx(expected, abs=2e-4)  # type: ignore[attr-defined]


def test_a_figure_that_is_not_met_leaves_only_the_rejection(tmp_path: Path, qtbot: QtBot) -> None:
    bench = touched(3)
    judged = bench(Finish("tool"))
    assert isinstance(judged, Judged)
    panel = OutcomePanel()
    qtbot.addWidget(panel)
    panel.show_outcome(judged)
    assert not panel.accept.isEnabled()
    with qtbot.waitSignal(panel.judged) as verdict:
        panel.reject.click()
    assert verdict.args == [False]
    with pytest.raises(CalibrationError, match="cannot be accepted"):
        bench(Keep(tmp_path, RIG.name, {}, accepted=True))


def test_a_companion_gives_way_to_the_window(preferred: None, qtbot: QtBot) -> None:
    companion = Companion(tells_its_priority, ())
    answers: list[int] = []
    companion.answered.connect(answers.append)
    companion.ask(None)
    qtbot.waitUntil(lambda: bool(answers), timeout=90_000)
    companion.end()
    assert answers[0] >= min(19, os.getpriority(os.PRIO_PROCESS, 0) + 5)


def test_a_companion_answers_in_order_and_tells_what_does_not_suffice(preferred: None, qtbot: QtBot) -> None:
    companion = Companion(CalibrationBench, ())
    answers: list[object] = []
    companion.answered.connect(answers.append)
    for request in (Begin(RIG, CharucoBoard()), TakeTouch(touching_pose(0)), Finish("tool")):
        companion.ask(request)
    qtbot.waitUntil(lambda: len(answers) == 3, timeout=90_000)
    assert isinstance(answers[1], TouchTaken)
    assert isinstance(answers[2], Failed)
    assert answers[2].message.startswith("tool: 1 touches")
    companion.end()


def test_an_answer_that_comes_after_its_companion_has_gone_is_dropped(preferred: None, qtbot: QtBot) -> None:
    companion = Companion(tells_its_priority, ())
    talker = [one for one in threading.enumerate() if one.name == "talk to tells_its_priority"][-1]
    companion.ask(None)
    delete(companion)
    companion.end()
    talker.join(timeout=60.0)
    assert not talker.is_alive()
