"""The same work in processes and on a Dask cluster, whatever becomes of a worker."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import pytest
from batch_tasks import diagnosed_by_workers
from study_cases import Fatal, Sleeping
from synthetic_diagnoses import small_experiment

from estimator.blind.making.making import make_cases
from estimator.blind.making.plan import plan
from estimator.blind.scoring.running import answer_cases
from estimator.cluster import dask_cluster
from estimator.errors import InputError, StudyError
from estimator.experiment import write_experiment
from estimator.fit.linearisation import silent
from estimator.studies.running.campaign import run_cases
from estimator.studies.running.case import Outcome
from estimator.studies.running.store import OutcomeStore
from estimator.workers import worker_pool

CASES = [Sleeping(number, seconds=0.2) for number in range(8)]
# Ends with its standard input. A worker that is lost is started again.
CLUSTER = """
import sys
from distributed import LocalCluster
if __name__ == "__main__":
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        print(cluster.scheduler_address, flush=True)
        sys.stdin.read()
"""


def numbers(outcomes: Sequence[Outcome]) -> list[float]:
    return [float(outcome.row["youngs_modulus"]) for outcome in outcomes if outcome.row is not None]


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Where the scheduler of a cluster of two workers answers, all in processes of their own."""
    script = tmp_path_factory.mktemp("cluster") / "cluster.py"
    script.write_text(CLUSTER, encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    with subprocess.Popen(
        [sys.executable, str(script)],
        cwd=script.parent,
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as cluster:
        assert cluster.stdin is not None
        assert cluster.stdout is not None
        yield cluster.stdout.readline().strip()
        cluster.stdin.close()


@dataclass
class Killer:
    """Hears of the progress, and kills a worker of a cluster when the first case is done."""

    scheduler: str
    victims: list[int] = field(default_factory=list)

    def __call__(self, text: str, done: int, total: int) -> None:
        if done and not self.victims:
            from distributed import Client

            with Client(self.scheduler, set_as_default=False) as client:
                self.victims.append(next(iter(client.run(os.getpid).values())))
            os.kill(self.victims[0], signal.SIGKILL)


def test_a_cluster_that_loses_a_worker_midway_gives_every_row(scheduler: str, tmp_path: Path) -> None:
    killer = Killer(scheduler)
    start = partial(dask_cluster, scheduler)
    outcomes = run_cases(CASES, OutcomeStore(tmp_path), start, killer)
    assert numbers(outcomes) == list(range(8))
    (victim,) = killer.victims
    assert {outcome.row["process"] for outcome in outcomes if outcome.row} - {victim, os.getpid()}


def test_sealed_cases_are_answered_by_a_cluster_that_loses_a_worker_midway(
    scheduler: str, tmp_path: Path
) -> None:
    names = [f"case{number}" for number in range(6)]
    for name in names:
        write_experiment(small_experiment("pull", 1), tmp_path / "cases" / name / "pull")
    killer = Killer(scheduler)
    workers = partial(dask_cluster, scheduler)
    answers = tmp_path / "answers"
    batch = answer_cases(diagnosed_by_workers, tmp_path / "cases", answers, workers=workers, progress=killer)
    assert (batch.done, batch.failed) == (tuple(names), {})
    assert len(killer.victims) == 1
    assert sorted(file.name for file in answers.iterdir()) == [f"{name}.json" for name in names]


def test_a_cluster_makes_the_same_sealed_cases_as_a_process(scheduler: str, tmp_path: Path) -> None:
    cases = plan(5, 1, ["none"], form_set="catalogue")
    ways = {"cluster": partial(dask_cluster, scheduler), "pool": partial(worker_pool, 1)}
    for name, workers in ways.items():
        made = make_cases(cases, tmp_path / name, tmp_path / f"{name}-keys", workers=workers, quick=True)
        assert (len(made.made), made.failed) == (1, {})
    (case,) = (tmp_path / "pool").glob("*/")
    files = [file.relative_to(case) for file in case.rglob("*") if file.is_file()]
    assert len(files) > 2
    for file in files:
        assert (tmp_path / "cluster" / case.name / file).read_bytes() == (case / file).read_bytes()


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
    monkeypatch.setattr("estimator.cluster._PATIENCE_S", 0.5)
    start = partial(dask_cluster, "tcp://127.0.0.1:1")
    with pytest.raises(InputError, match="no Dask scheduler answers there"):
        run_cases(CASES, OutcomeStore(tmp_path), start, silent)
