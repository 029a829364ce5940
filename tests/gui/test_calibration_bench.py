import os
import threading
from pathlib import Path

import numpy as np
import pytest
from job_tasks import tells_its_priority
from pytestqt.qtbot import QtBot
from shiboken6 import delete

from daq.calibration.of_rig import why_not
from daq.calibration_files.outcome import Kind
from daq.calibration_files.record import read_record
from daq.errors import CalibrationError
from daq.rig import Rig
from daq.virtual_rig.layout import FRAMES, Addresses, rig_description
from daq.virtual_rig.operator import BOARD, TOUCHES, board_pose, touching_pose
from daq.virtual_rig.rendering.board_scene import BoardScene
from daq.virtual_rig.rendering.scene import flea2_above, flea2_pair
from daq.vision.camera_model import PinholeCamera
from daq.vision.charuco import CharucoBoard
from gui.calibration.bench import (
    Begin,
    CalibrationBench,
    Finish,
    Judged,
    Keep,
    Kept,
    TakeTouch,
    TakeView,
    TouchTaken,
    ViewTaken,
)
from gui.jobs.companion import Companion
from gui.jobs.process import Failed
from gui.widgets.results.outcome_panel import OutcomePanel

RIG = rig_description(Addresses(1, 2, 3, 4, 5, 6, ("tcp://a", "tcp://b")), Path("stereo.toml"))
ONE_CAMERA = rig_description(Addresses(1, 2, 3, 4, 5, 6, ("tcp://a",)), Path("camera.toml"))
PAIR = (flea2_pair().left, flea2_pair().right)
VIEWS = 14


def touched(count: int) -> CalibrationBench:
    bench = CalibrationBench()
    bench(Begin(RIG, "tool", CharucoBoard()))
    for number in range(count):
        taken = bench(TakeTouch(touching_pose(number)))
        assert isinstance(taken, TouchTaken)
        assert taken.figures.touches == number + 1
    return bench


def test_a_calibration_is_collected_judged_and_kept(tmp_path: Path) -> None:
    bench = touched(TOUCHES)
    judged = bench(Finish())
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
    judged = bench(Finish())
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


@pytest.mark.parametrize(
    ("kind", "cameras", "figures"),
    [("camera", (flea2_above(),), {"coverage"}), ("cameras", PAIR, {"left coverage", "right coverage"})],
)
def test_views_of_the_board_are_collected_and_judged_whoever_sees_it(
    tmp_path: Path, kind: Kind, cameras: tuple[PinholeCamera, ...], figures: set[str]
) -> None:
    rig = ONE_CAMERA if len(cameras) == 1 else RIG
    scenes = [BoardScene(camera, BOARD) for camera in cameras]
    bench = CalibrationBench()
    bench(Begin(rig, kind, BOARD))
    for number in range(VIEWS):
        taken = bench(TakeView(tuple(one.render(board_pose(number), number) for one in scenes), "mono8"))
        assert isinstance(taken, ViewTaken)
        assert len(taken.coverage) == len(taken.figures.coverage) == len(cameras)
        assert taken.figures.views == number + 1
    dark = np.zeros((cameras[0].height, cameras[0].width), np.uint8)
    refused = bench(TakeView((dark,) * len(cameras), "mono8"))
    assert isinstance(refused, ViewTaken)
    assert refused.figures.describe().startswith("not taken: ")
    judged = bench(Finish())
    assert isinstance(judged, Judged)
    assert judged.acceptable
    assert judged.plot.startswith(b"\x89PNG")
    assert figures <= {figure.name for figure in judged.figures}
    kept = bench(Keep(tmp_path, rig.name, {}, accepted=True))
    assert isinstance(kept, Kept)
    assert read_record(kept.path).kind == kind


@pytest.mark.parametrize(
    ("rig", "kind"), [(ONE_CAMERA, "cameras"), (ONE_CAMERA, "stereo"), (ONE_CAMERA, "robot"), (RIG, "camera")]
)
def test_what_the_rig_is_not_calibrated_by_is_refused_as_on_the_command_line(rig: Rig, kind: Kind) -> None:
    bench = CalibrationBench()
    with pytest.raises(CalibrationError) as refused:
        bench(Begin(rig, kind, BOARD))
    assert str(refused.value) == why_not(kind, rig)
    with pytest.raises(CalibrationError, match="begin the calibration first"):
        bench(Finish())


def test_an_image_too_few_is_refused_with_what_is_asked() -> None:
    bench = CalibrationBench()
    bench(Begin(RIG, "stereo", BOARD))
    with pytest.raises(CalibrationError, match="1 images of one moment, but 2 cameras are to see it"):
        bench(TakeView((np.zeros((964, 1288), np.uint8),), "mono8"))


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
    for request in (Begin(RIG, "tool", CharucoBoard()), TakeTouch(touching_pose(0)), Finish()):
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
