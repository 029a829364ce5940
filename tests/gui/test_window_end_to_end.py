import random
from pathlib import Path

import numpy as np
import pytest
from conftest import Operator, bring_to_rest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QFileDialog
from pytestqt.qtbot import QtBot
from retraction_cases import COARSE_GRADING, SMALL_BLOCK, follow, recorded, straight_pull
from session_endings import stop_of, wait_until_sealed
from synthetic_diagnoses import inclusion

from daq.recording.folder import read_info
from daq.recording.reader import Recording
from daq.virtual_rig.launch import VirtualRig
from daq.virtual_rig.layout import REST_TOOL
from estimator.experiment import Experiment, read_experiment, write_experiment
from estimator.fem.equilibrium.newton import EquilibriumSolver
from estimator.fem.equilibrium.observation import observe
from estimator.forward.meshing import mesh_experiment
from estimator.materials import NeoHookean
from estimator.materials.material import Material
from gui.pages.acquire import AcquirePage
from gui.pages.diagnose import DiagnosePage
from gui.pages.estimate import EstimatePage
from gui.pages.rig import RigPage
from gui.pages.sessions import SessionsPage
from gui.recording.work_queue import Entry
from gui.window import STOPPED

STARVED = "the controlling program has been silent"
"""A window that gets no processor for most of a second has the robot held as well, as it should."""

TRUTH = Material(NeoHookean(), 12e3, 0.46)
PATIENCE_MS = 60_000

SHORT = {"steps": 1, "return_steps": 1, "settle_s": 0.1, "measure_s": 0.3}


def test_a_tare_zeroes_what_is_shown_and_can_be_undone(at_rest: Operator) -> None:
    link, page = at_rest.link, at_rest.window.page(RigPage)
    at_rest.wait_until(lambda: all(row.health == "good" for row in link.state.rows), "all lamps")
    at_rest.wait_until(lambda: link.state.rows[0].counts.received > 2000, "some seconds of samples")
    raw_n = link.state.force_n
    at_rest.press(page.tare_button)
    at_rest.wait_until(lambda: len(link.tares.tares) == 1 and link.state.force_n < 0.2, "a zeroed force")
    assert raw_n > 10.0
    at_rest.press(page.undo_button)
    at_rest.wait_until(lambda: link.state.force_n == pytest.approx(raw_n, abs=0.2), "the raw force")


@pytest.fixture(scope="module")
def retractions(operator: Operator, laboratory: VirtualRig) -> tuple[Entry, ...]:
    """The three standard retractions, short ones, recorded from the queue."""
    bring_to_rest(operator, laboratory)
    acquire = operator.window.page(AcquirePage)
    for kind in ("pull", "gradual_tangent_pull", "twist_and_pull"):
        acquire.trial_panel.card(kind).click()
        turn = {} if kind == "pull" else {"angle_rad": 0.05}
        acquire.trial_panel.form.set_values({**SHORT, **turn})
        operator.press(acquire.add_button)
    operator.press(acquire.run_button)
    operator.wait_until(lambda: not acquire.runner.going_on, "the end of the queue")
    operator.wait_until(lambda: not acquire.runner.running, "the end of the last session")
    return acquire.runner.queue[-3:]


def test_the_three_retractions_are_recorded_from_the_queue(retractions: tuple[Entry, ...]) -> None:
    assert [(entry.state, entry.remark) for entry in retractions] == [("done", "")] * 3
    infos = [read_info(entry.session) for entry in retractions if entry.session is not None]
    assert [info.trajectory["kind"] for info in infos] == ["pull", "gradual_tangent_pull", "twist_and_pull"]
    assert [info.order for info in infos] == [1, 2, 3]
    assert {info.state for info in infos} == {"sealed"}


def test_what_was_recorded_is_replayed_and_exported(
    at_rest: Operator, retractions: tuple[Entry, ...], tmp_path: Path, qtbot: QtBot
) -> None:
    window, context = at_rest.window, at_rest.context
    session, page = retractions[0].session, window.page(SessionsPage)
    assert session is not None
    with qtbot.waitSignal(page.replay.opened, timeout=PATIENCE_MS):
        context.navigator.replay_requested.emit(session)
    assert page.isVisible()
    page.replay.slider.setValue(page.replay.slider.maximum() // 2)
    at_rest.wait_until(lambda: page.replay.words.text() != "", "what was done at that instant")

    page.form.setCurrentIndex(page.form.findData("experiment"))
    page.export_to(session, "experiment", tmp_path / "exported")
    at_rest.wait_until(lambda: page.strip.idle, "the exported experiment")
    exported = read_experiment(tmp_path / "exported")
    assert exported.phase == ("hold", "hold", "return_hold")
    assert window.messages.message is not None
    assert window.messages.message.what.startswith("Exported: 3 synchronised rows")


@pytest.mark.timeout(300)
def test_an_experiment_is_estimated_and_its_diagnosis_begun(at_rest: Operator, tmp_path: Path) -> None:
    """Its diagnosis takes minutes, so it is cancelled; its page shows one that is made up."""
    window, context = at_rest.window, at_rest.context
    write_experiment(pulled_block(), tmp_path / "pull")
    estimate, diagnose = window.page(EstimatePage), window.page(DiagnosePage)
    context.navigator.estimate_requested.emit((tmp_path / "pull",))
    assert estimate.isVisible()
    assert not estimate.begin.isEnabled()
    at_rest.wait_until(lambda: estimate.strip.idle, "the estimate")
    found = estimate.estimate
    assert found is not None
    assert found.youngs_modulus.value == pytest.approx(TRUTH.youngs_modulus, rel=0.05)
    assert estimate.result.body.slider.maximum() == len(found.fits[0].experiment.time) - 1

    estimate.result.diagnose.click()
    assert diagnose.isVisible()
    assert not diagnose.strip.idle
    diagnose.strip.cancel.click()
    at_rest.wait_until(lambda: diagnose.strip.idle, "the end of the diagnosis")
    diagnose.add(inclusion(), (tmp_path / "pull",))
    assert diagnose.result.ranking.isVisible()


def pulled_block() -> Experiment:
    """A small block pulled by 12 mm, of known material."""
    problem = mesh_experiment(SMALL_BLOCK, COARSE_GRADING, "hex27")
    poses = straight_pull(SMALL_BLOCK, 0.012, 4)
    states = [EquilibriumSolver(problem).rest(TRUTH), *follow(problem, TRUTH, poses)]
    seen = [observe(problem, state) for state in states]
    return recorded(SMALL_BLOCK, [state.pose for state in states], seen, np.random.default_rng(5))


def test_what_a_limit_forbids_is_told_by_its_step_and_nothing_moves(at_rest: Operator) -> None:
    page, told = at_rest.window.page(AcquirePage), []
    page.trial_panel.choose("pull")
    page.trial_panel.form.set_values({"steps": 30, "step_length_m": 0.0022})
    at_rest.link.checked.connect(lambda checked: told.append(checked.failure.message))
    at_rest.press(page.check_button)
    at_rest.wait_until(lambda: bool(told), "the verdict")
    assert told[0].startswith("pull, step 14: the gripper at (70.8")
    assert told[0].endswith("mm would leave the workspace")
    at_rest.press(page.start_button)
    at_rest.wait_until(lambda: page.runner.queue[-1].state == "failed", "the refusal")
    assert page.runner.queue[-1].session is None
    tool = at_rest.link.state.tool
    assert tool is not None
    np.testing.assert_allclose(tool[:3], REST_TOOL.position, atol=1e-4)


def test_the_stop_key_holds_the_robot_at_any_instant_whatever_has_the_focus(
    at_rest: Operator, qtbot: QtBot
) -> None:
    window, link = at_rest.window, at_rest.link
    folder = at_rest.begin_slow_pull()
    chance = random.Random(folder.name)
    dialog = QFileDialog(window)
    dialog.setModal(False)
    dialog.show()
    qtbot.wait(chance.randrange(1000))
    qtbot.keyClick(dialog, Qt.Key.Key_Escape)
    at_rest.wait_until(lambda: link.state.phase == "held" and link.state.session is None, "a held robot")
    reason = stop_of(folder)[0]
    assert reason == STOPPED or STARVED in reason
    assert dialog.isVisible() or STARVED in reason
    dialog.close()
    dialog.deleteLater()
    assert read_info(folder).state == "sealed"
    assert window.messages.message is not None
    assert "held the robot" in window.messages.message.what
    assert "sealed" in window.messages.message.safe
    assert [entry.state for entry in window.page(AcquirePage).runner.queue].count("stopped") == 1


def test_closing_while_the_robot_moves_asks_then_holds_and_seals(at_rest: Operator, qtbot: QtBot) -> None:
    window = at_rest.window
    folder = at_rest.begin_slow_pull()
    window.close()
    assert window.isVisible()
    assert window.messages.message is not None
    assert "Close nevertheless?" in window.messages.message.what
    assert QApplication.activeModalWidget() is None
    window.messages.answer("Go on recording").click()
    qtbot.wait(200)
    assert window.isVisible()
    assert window.messages.message is None or "Close" not in window.messages.message.what

    window.close()
    window.messages.answer("Hold the robot, seal, and close").click()
    at_rest.wait_until(lambda: not window.isVisible(), "the end of the window")
    wait_until_sealed(folder)
    assert read_info(folder).state == "sealed"
    reason = stop_of(folder)[0]
    assert reason == "the client has closed" or STARVED in reason
    assert len(Recording(folder).force) > 500
