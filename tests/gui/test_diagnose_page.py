"""The Diagnose page: the answer, each cause looked at, two diagnoses compared, and what to do next."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtWidgets import QPushButton
from pytestqt.qtbot import QtBot
from stand_in_jobs import StandInJobs, without_processes
from synthetic_diagnoses import inclusion, no_gap, outcome, two_causes, unexplained

from daq.plans import Trial
from estimator.diagnosis.conclusions.design_of_experiments import MANOEUVRES
from estimator.diagnosis.result import Advice, Consideration, Diagnosis
from gui.analysis.comparison import comparison_rows
from gui.analysis.computations import diagnose_sources, try_cause
from gui.context import Context
from gui.messages import Message
from gui.pages.diagnose import DiagnosePage
from gui.widgets.results.cause_details import cause_facts
from gui.widgets.results.ranking import ranked_causes

SOURCES = (Path("sessions/pull").absolute(), Path("sessions/twist").absolute())


@pytest.fixture
def jobs_and_page(context: Context, qtbot: QtBot) -> tuple[StandInJobs, DiagnosePage]:
    changed, jobs = without_processes(context)
    page = DiagnosePage(changed)
    qtbot.addWidget(page)
    page.show()
    return jobs, page


def with_manoeuvre() -> Diagnosis:
    """A diagnosis that advises something the robot can do, and a measurement beside the rig."""
    return replace(
        inclusion(),
        next_experiment=(
            Advice(MANOEUVRES[0].words, ("inhomogeneity", "modulus_gradient"), 3.4, 9.8, MANOEUVRES[0]),
            Advice("hang a known weight on the gripper", ("inhomogeneity", "anisotropy"), 5.0, float("nan")),
        ),
    )


def test_a_diagnosis_runs_on_what_is_asked_for_and_is_shown(
    jobs_and_page: tuple[StandInJobs, DiagnosePage], context: Context
) -> None:
    jobs, page = jobs_and_page
    context.navigator.diagnose_requested.emit(SOURCES)
    assert [(job.task, job.arguments) for job in jobs.asked] == [(diagnose_sources, (SOURCES,))]
    assert not page.begin.isEnabled()
    jobs.asked[0].finish(inclusion())
    assert page.begin.isEnabled()
    assert page.result.verdict.text().startswith("Inhomogeneity (93 %) causes the gap")
    assert "94 % of it closes" in page.result.told.text()
    assert page.history.count() == 1


@pytest.mark.parametrize("made", [no_gap, inclusion, unexplained, two_causes])
def test_every_kind_of_answer_can_be_shown_and_drawn(
    made: Callable[[], Diagnosis], jobs_and_page: tuple[StandInJobs, DiagnosePage]
) -> None:
    _, page = jobs_and_page
    page.add(made(), SOURCES)
    for tab in range(page.result.tabs.count()):
        page.result.tabs.setCurrentIndex(tab)
        assert not page.grab().isNull()
    for row in range(page.result.ranking.rowCount()):
        page.result.ranking.selectRow(row)


def test_the_ranking_begins_with_the_verdict_and_holds_every_effect() -> None:
    found = inclusion()
    ranked = ranked_causes(found)
    assert ranked[0].label == "inhomogeneity"
    assert ranked[0].texts == ("inhomogeneity", "93 %", "present")
    assert ranked[0].named
    assert {cause.label for cause in ranked} >= set(found.effects)


def test_a_cause_that_is_clicked_shows_what_it_closes_and_what_e_becomes(
    jobs_and_page: tuple[StandInJobs, DiagnosePage],
) -> None:
    _, page = jobs_and_page
    found = inclusion()
    page.add(found, SOURCES)
    facts = cause_facts(found, "inhomogeneity")
    assert facts["gap closes, predicted"].startswith("88 %")
    assert facts["gap closes, achieved"].startswith("94 %")
    assert "24.10 ± 0.15 kPa → 26.05 ± 0.18 kPa" in facts["E and ν, without → with"]
    assert not page.result.details.add.isVisible()
    page.result.ranking.choose("modulus_gradient")
    assert page.result.details.heading.text() == "Modulus gradient"
    assert page.result.details.add.isVisible()


def test_its_signature_is_drawn_beside_the_residual(
    jobs_and_page: tuple[StandInJobs, DiagnosePage],
) -> None:
    _, page = jobs_and_page
    found = inclusion()
    page.add(found, SOURCES)
    names = page.result.details.wrench.legend.text()
    assert "residual without it" in names
    assert "signature, to first order" in names
    assert "with it in the model" in names
    trace, considered = found.traces[0], found.considered["inhomogeneity"]
    signature = considered.expected.channels[0][:, 0] - trace.before[:, 0]
    panel = page.result.details.wrench.sheet.plots[0]
    drawn = [item.getData()[1] for item in panel.listDataItems()]
    assert any(len(y) == len(signature) and np.allclose(y, signature) for y in drawn)
    page.result.ranking.choose("unknown")
    assert "signature" not in page.result.details.wrench.legend.text()


def test_a_cause_can_be_added_to_the_model(jobs_and_page: tuple[StandInJobs, DiagnosePage]) -> None:
    jobs, page = jobs_and_page
    found = inclusion()
    page.add(found, SOURCES)
    page.result.ranking.choose("modulus_gradient")
    page.result.details.add.click()
    asked = [(job.task, job.arguments) for job in jobs.asked]
    assert asked == [(try_cause, (SOURCES, "modulus_gradient", found.gap.floor, found.errors_left))]
    expected = found.considered["modulus_gradient"].expected
    jobs.asked[0].finish(Consideration(expected, outcome(found.traces, 0.41)))
    shown = page.result.shown
    assert shown is not None
    facts = cause_facts(shown.diagnosis, "modulus_gradient")
    assert facts["gap closes, achieved"].startswith("41 %")
    assert page.result.details.heading.text() == "Modulus gradient"
    assert not page.result.details.add.isVisible()


def test_the_advised_manoeuvre_goes_into_the_queue(
    jobs_and_page: tuple[StandInJobs, DiagnosePage], context: Context
) -> None:
    _, page = jobs_and_page
    queued: list[Trial] = []
    context.navigator.trial_requested.connect(queued.append)
    page.add(with_manoeuvre(), SOURCES)
    buttons = [b for b in page.result.next.findChildren(QPushButton) if b.text() == "Put into the queue"]
    assert len(buttons) == 1
    buttons[0].click()
    trajectory = queued[0].lay_out(context.sessions_folder)
    farthest = max(step.T_rest_gripper.position[2] for step in trajectory.steps)
    assert farthest == pytest.approx(MANOEUVRES[0].offset_m[2])


def test_two_diagnoses_stand_side_by_side(jobs_and_page: tuple[StandInJobs, DiagnosePage]) -> None:
    _, page = jobs_and_page
    page.add(inclusion(), SOURCES)
    page.add(two_causes(), SOURCES)
    assert page.result.other.count() == 1
    rows = {name: (one, other) for name, one, other in comparison_rows(two_causes(), inclusion())}
    both = "viscoelasticity and anchor compliance and something outside the catalogue"
    assert rows["verdict"] == (both, "inhomogeneity")
    assert rows["gap closes"] == ("90 %", "94 %")
    assert rows["probability of inhomogeneity"] == ("0 %", "93 %")
    shown = page.result.comparison.item(0, 2)
    assert shown is not None
    assert shown.text() == "inhomogeneity"
    page.history.setCurrentRow(0)
    assert page.result.verdict.text().startswith("Inhomogeneity")


def test_a_failure_is_told(jobs_and_page: tuple[StandInJobs, DiagnosePage], context: Context) -> None:
    jobs, page = jobs_and_page
    told: list[Message] = []
    context.navigator.message_told.connect(told.append)
    context.navigator.diagnose_requested.emit(SOURCES)
    jobs.asked[0].fail("what was chosen is of 2 phantoms")
    assert [m.what for m in told] == ["No diagnosis: what was chosen is of 2 phantoms"]
    assert not page.result.isVisible()
