"""A published table's experiments redone: estimated the paper's way and ours."""

from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from estimator.fit.estimate import estimate
from estimator.fit.linearisation import silent
from estimator.forward.meshing import mesh_experiment
from estimator.studies.published_gap.diagnosis import GapDiagnosis, Ranking
from estimator.studies.published_gap.learning import ResponseMap
from estimator.studies.published_gap.pattern import PatternModel
from estimator.studies.published_gap.pattern_fit import PatternFit
from estimator.studies.published_gap.published import Bench, PublishedEstimate, PublishedTable
from estimator.studies.published_gap.redone import redo_experiments, redone_text
from estimator.studies.published_gap.retractions import SetUp
from estimator.studies.published_gap.simulated import GRADING, USUAL_RATIO
from estimator.studies.published_gap.simulations import CONDITIONS, learning_cases
from estimator.studies.running.case import run_case
from estimator.studies.running.store import OutcomeStore

TISSUE_PA = 30e3
SET_UP = SetUp(steps=1)
CELLS = (6, 6, 1)
# of one step, from the scatter of the six conditions
NOISE_IN_MODULUS = 0.014


@contextmanager
def one_after_another() -> Iterator[Executor]:
    with ThreadPoolExecutor(1) as pool:
        yield pool


@pytest.fixture(autouse=True)
def on_the_mesh_that_was_simulated_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """Spare the estimates the finer mesh that they measure their error of discretisation against."""
    mesh = partial(mesh_experiment, grading=GRADING)
    monkeypatch.setattr(
        "estimator.studies.published_gap.redone.estimate", partial(estimate, mesh=mesh, finer_mesh=mesh)
    )


@pytest.fixture
def without_a_cause() -> GapDiagnosis:
    """The diagnosis of a table that the paper's estimator would report of a tissue without any effect."""
    outcomes = {case.identity: run_case(case) for case in learning_cases(SET_UP, [], CELLS)}
    response = ResponseMap(SET_UP, [], outcomes, cells=CELLS)
    gain, ratio = response.locking
    rows = tuple(
        PublishedEstimate("A", anchoring, motion, float(TISSUE_PA * gain[n]), float(ratio[n]))
        for n, (anchoring, motion) in enumerate(CONDITIONS)
    )
    table = PublishedTable("planted", {"A": Bench(TISSUE_PA, 300.0)}, rows, SET_UP)
    fit = PatternFit(PatternModel(table, (), response), (True,) * len(rows))
    return GapDiagnosis(table, response, (), Ranking.of([fit.found(fit.run())]), ())


def test_without_a_cause_the_papers_way_locks_and_ours_finds_the_tissue(
    without_a_cause: GapDiagnosis, tmp_path: Path
) -> None:
    redone = redo_experiments(without_a_cause, OutcomeStore(tmp_path), one_after_another, silent)
    assert [one.published for one in redone] == list(without_a_cause.table.estimates)
    assert sum(line.split()[:1] == ["A"] for line in redone_text(redone).splitlines()) == len(CONDITIONS)
    gain, ratio = without_a_cause.response.locking
    tissue = np.array([one.tissue_pa for one in redone])
    np.testing.assert_allclose(tissue, TISSUE_PA, rtol=0.02)
    paper, ours = (np.array([getattr(one, way) for one in redone]) for way in ("paper", "ours"))
    np.testing.assert_allclose(paper[:, 0] / tissue, gain, rtol=3 * NOISE_IN_MODULUS)
    np.testing.assert_allclose(paper[:, 1], ratio, atol=0.01)
    np.testing.assert_allclose(ours[:, 0] / tissue, 1.0, rtol=3 * NOISE_IN_MODULUS)
    np.testing.assert_allclose(ours[:, 1], USUAL_RATIO, atol=0.01)
