"""The Estimate page: from what is checked to E and ν, and to what the fit leaves unexplained."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pytestqt.qtbot import QtBot
from stand_in_jobs import StandInJobs, without_processes
from synthetic_diagnoses import small_experiment
from synthetic_estimates import estimate_of, made_up_budget, pull_fit

from daq.progress import silent
from estimator.errors import InputError
from estimator.experiment import write_experiment
from estimator.fit.online import OnlineEstimate
from estimator.fit.result import ParameterEstimate
from estimator.materials import LAWS, Law, Yeoh
from gui.analysis.computations import estimate_sources, write_estimate_page
from gui.analysis.following import FollowedStep, follow_session
from gui.analysis.sources import experiments_of, stated_by
from gui.context import Context
from gui.jobs.process import Progressed, Reporter
from gui.messages import Message
from gui.pages.estimate import EstimatePage
from gui.rig.state import RigState
from robot_drivers.clock import host_time_ns


@pytest.fixture
def jobs_and_page(context: Context, qtbot: QtBot) -> tuple[StandInJobs, EstimatePage]:
    changed, jobs = without_processes(context)
    page = EstimatePage(changed)
    qtbot.addWidget(page)
    page.show()
    return jobs, page


def after_step(step: int) -> FollowedStep:
    modulus = ParameterEstimate(12e3 + step, 150.0, (11.7e3, 12.3e3))
    ratio = ParameterEstimate(0.46, 0.004, (0.452, 0.468))
    found = OnlineEstimate(step, {"youngs_modulus": modulus, "poisson_ratio": ratio}, 1.02, 0.2)
    return FollowedStep(found, host_time_ns() - 3 * 10**9, np.zeros((2, 3)))


def stored(folder: Path, name: str = "pull", **changes: object) -> Path:
    write_experiment(replace(small_experiment(name), **changes), folder)  # type: ignore[arg-type]
    return folder


def test_nothing_can_be_estimated_before_something_is_checked(
    jobs_and_page: tuple[StandInJobs, EstimatePage], tmp_path: Path
) -> None:
    jobs, page = jobs_and_page
    assert not page.begin.isEnabled()
    page.picker.choose((stored(tmp_path / "pull"),))
    page.begin.click()
    assert [(job.task, job.arguments) for job in jobs.asked] == [
        (estimate_sources, ((tmp_path / "pull",), "neo_hookean"))
    ]
    assert page.strip.isVisible()
    page.strip.cancel.click()
    assert jobs.asked[0].cancel_asked


def test_the_laws_to_choose_from_are_those_of_this_project_and_of_other_packages(
    context: Context, qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = {**LAWS, "demiray": Yeoh(2)}
    monkeypatch.setattr("gui.pages.estimate.installed_laws", lambda: other)
    changed, jobs = without_processes(context)
    page = EstimatePage(changed)
    qtbot.addWidget(page)
    assert [page.law.itemText(number) for number in range(page.law.count())] == list(other)
    page.picker.choose((stored(tmp_path / "pull"),))
    page.law.setCurrentText("demiray")
    page.begin.click()
    assert jobs.asked[0].arguments == ((tmp_path / "pull",), "demiray")


def test_a_broken_package_leaves_the_laws_of_this_project(
    context: Context, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken() -> dict[str, Law]:
        raise InputError("package old 1.0, entry point 'x' of retract.materials: cannot be imported")

    monkeypatch.setattr("gui.pages.estimate.installed_laws", broken)
    told: list[Message] = []
    context.navigator.message_told.connect(told.append)
    page = EstimatePage(context)
    qtbot.addWidget(page)
    assert page.law.count() == len(LAWS)
    qtbot.waitUntil(lambda: len(told) == 1)
    assert "package old 1.0" in told[0].what


def test_the_result_tells_values_intervals_and_what_is_left(
    jobs_and_page: tuple[StandInJobs, EstimatePage],
) -> None:
    _, page = jobs_and_page
    page.show_estimate(estimate_of(pull_fit("pull"), pull_fit("twist", noise=3.0, seed=2)))
    result = page.result
    assert "E = 20.00 kPa (95 %: 19.77 to 20.24)" in result.parameters.text()
    assert "ν = 0.4512 (95 %: 0.4469 to 0.4553)" in result.parameters.text()
    assert "1.02 times the stated noise" in result.verdict.text()
    channels = [result.residuals.item(row, 0) for row in range(result.residuals.rowCount())]
    assert [cell.text() for cell in channels if cell is not None][:3] == ["fx", "fy", "fz"]
    of_pull = [result.residuals.item(0, 2), result.experiment.currentText()]
    result.experiment.setCurrentIndex(1)
    assert result.experiment.currentText() == "twist"
    assert of_pull[1] == "pull"
    sigma = result.residuals.item(0, 2)
    assert sigma is not None
    assert float(sigma.text()) > 2.0


def test_a_budget_has_a_tab_where_there_is_one(jobs_and_page: tuple[StandInJobs, EstimatePage]) -> None:
    _, page = jobs_and_page
    result = page.result
    page.show_estimate(estimate_of(pull_fit()))
    assert not result.tabs.isTabVisible(result.tabs.indexOf(result.budget))
    page.show_estimate(replace(estimate_of(pull_fit()), budget=made_up_budget()))
    assert result.tabs.isTabVisible(result.tabs.indexOf(result.budget))
    assert "begin with the force sensor" in result.budget.sentences.text()
    first = result.budget.sources.item(0, 0), result.budget.devices.item(0, 0)
    assert [cell.text() for cell in first if cell is not None] == ["noise of the beads *", "cameras"]
    assert result.budget.sources.rowCount() == 3


def test_calibrations_of_a_session_tell_sizes_and_a_folder_none(tmp_path: Path) -> None:
    assert not stated_by((stored(tmp_path / "pull"),)).sizes


def test_a_failure_is_told_in_one_line_and_the_page_goes_on(
    jobs_and_page: tuple[StandInJobs, EstimatePage], context: Context, tmp_path: Path
) -> None:
    jobs, page = jobs_and_page
    told: list[Message] = []
    context.navigator.message_told.connect(told.append)
    page.picker.choose((stored(tmp_path / "pull"),))
    page.begin.click()
    jobs.asked[0].fail("the measured force does not oppose the motion")
    assert [(m.severity, m.what) for m in told] == [
        ("error", "No estimate: the measured force does not oppose the motion")
    ]
    assert page.begin.isEnabled()
    assert not page.strip.isVisible()


def test_what_was_estimated_can_be_diagnosed(
    jobs_and_page: tuple[StandInJobs, EstimatePage], context: Context, tmp_path: Path
) -> None:
    jobs, page = jobs_and_page
    asked: list[object] = []
    context.navigator.diagnose_requested.connect(asked.append)
    page.picker.choose((stored(tmp_path / "pull"),))
    page.begin.click()
    jobs.asked[0].finish(estimate_of(pull_fit()))
    page.result.diagnose.click()
    assert asked == [(tmp_path / "pull",)]


def test_a_session_that_begins_is_followed_where_that_is_wanted(
    jobs_and_page: tuple[StandInJobs, EstimatePage], context: Context
) -> None:
    jobs, page = jobs_and_page
    running = RigState(phase="running", session=context.sessions_folder / "now")
    context.link.state_changed.emit(running)
    assert jobs.asked == []
    page.follow.setChecked(True)
    assert jobs.prepared
    for _ in range(3):
        context.link.state_changed.emit(running)
    assert [(job.task, job.arguments) for job in jobs.asked] == [(follow_session, (running.session,))]
    late: list[tuple[int, float]] = []
    page.step_shown.connect(lambda step, late_s: late.append((step, late_s)))
    for step in (1, 2):
        jobs.asked[0].shown.emit(after_step(step))
    assert [step for step, _ in late] == [1, 2]
    assert all(3.0 < late_s < 60.0 for _, late_s in late)
    assert page.result.parameters.text().startswith("E = 12.")
    assert page.result.verdict.text().startswith("After step 2 of a running session, 3.")
    modulus = page.result.convergence.sheet.plots[0]
    assert modulus.listDataItems()[0].getData()[0].tolist() == [1.0, 2.0]
    assert not page.result.save.isEnabled()
    jobs.asked[0].finish(estimate_of(pull_fit()))
    assert page.result.save.isEnabled()
    assert "E = 20.00 kPa" in page.result.parameters.text()


def test_a_report_is_written_once(tmp_path: Path) -> None:
    report = Reporter(lambda message: None)
    page = write_estimate_page(report, estimate_of(pull_fit()), tmp_path / "estimation.html")
    assert "E = 20.00 kPa" in page.read_text(encoding="utf-8")
    assert json.loads(page.with_suffix(".json").read_text())["youngs_modulus"]["value"] == 20_000.0
    with pytest.raises(InputError, match="exists already"):
        write_estimate_page(report, estimate_of(pull_fit()), page)


def test_sources_are_of_one_phantom_and_told_apart(tmp_path: Path) -> None:
    one, same = stored(tmp_path / "one"), stored(tmp_path / "two", order=2)
    assert [e.name for e in experiments_of((same, one), silent)] == ["pull (1)", "pull (2)"]
    other = stored(tmp_path / "other", phantom_id="P08")
    with pytest.raises(InputError, match="2 phantoms"):
        experiments_of((one, other), silent)


def test_a_reporter_tells_progress_as_any_long_work_does() -> None:
    told: list[object] = []
    Reporter(told.append)("finding the beads", 3, 10)
    assert told == [Progressed("finding the beads", 3, 10)]
