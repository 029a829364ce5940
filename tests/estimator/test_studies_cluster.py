"""The same cases in processes and on a Dask cluster, whatever becomes of a worker."""

import os
import signal
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import pytest
from distributed import LocalCluster
from study_cases import Fatal, Sleeping

from estimator.errors import InputError, StudyError
from estimator.fit.linearisation import silent
from estimator.studies.running.campaign import run_cases
from estimator.studies.running.case import Outcome
from estimator.studies.running.cluster import dask_cluster
from estimator.studies.running.store import OutcomeStore
from estimator.workers import worker_pool

CASES = [Sleeping(number, seconds=0.2) for number in range(8)]


def numbers(outcomes: Sequence[Outcome]) -> list[float]:
    return [float(outcome.row["youngs_modulus"]) for outcome in outcomes if outcome.row is not None]


@pytest.fixture
def cluster() -> Iterator[LocalCluster]:
    """Two workers in processes of their own, without a page to watch them."""
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as started:
        yield started


def test_a_cluster_that_loses_a_worker_midway_gives_every_row(cluster: LocalCluster, tmp_path: Path) -> None:
    victims: list[int] = []

    def kill_one(text: str, done: int, total: int) -> None:
        if text.startswith("done") and not victims:
            victims.append(next(iter(cluster.workers.values())).pid)
            os.kill(victims[0], signal.SIGKILL)

    start = partial(dask_cluster, cluster.scheduler_address)
    outcomes = run_cases(CASES, OutcomeStore(tmp_path), start, kill_one)
    assert numbers(outcomes) == list(range(8))
    assert len(victims) == 1
    assert {outcome.row["process"] for outcome in outcomes if outcome.row} - {victims[0], os.getpid()}


def test_processes_give_every_row_in_the_order_of_the_cases(tmp_path: Path) -> None:
    outcomes = run_cases(CASES, OutcomeStore(tmp_path), partial(worker_pool, 2), silent)
    assert numbers(outcomes) == list(range(8))
    assert os.getpid() not in {outcome.row["process"] for outcome in outcomes if outcome.row}


def test_a_worker_that_dies_is_told_and_what_was_done_is_kept(tmp_path: Path) -> None:
    store = OutcomeStore(tmp_path)
    with pytest.raises(StudyError, match=r"a worker died .*: 1 of 2 cases are kept"):
        run_cases([Sleeping(1), Fatal()], store, partial(worker_pool, 1), silent)
    kept = store.read(Sleeping(1))
    assert kept is not None
    assert numbers([kept]) == [1.0]


def test_a_scheduler_that_does_not_answer_is_told_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("estimator.studies.running.cluster._PATIENCE_S", 0.5)
    start = partial(dask_cluster, "tcp://127.0.0.1:1")
    with pytest.raises(InputError, match="no Dask scheduler answers there"):
        run_cases(CASES, OutcomeStore(tmp_path), start, silent)
