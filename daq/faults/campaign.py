"""Many sessions with faults: which fault comes in which run, several rigs at once, results that outlive a stop.

Everything about a run follows from the campaign's seed and the run's number, so that one run can be done again.
"""

import multiprocessing
import queue
import tempfile
import traceback
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from multiprocessing.process import BaseProcess
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from daq.errors import DaqError
from daq.faults.bench import Bench, bench
from daq.faults.catalogue import FAULTS
from daq.faults.clients import Client
from daq.faults.fault import Fault
from daq.faults.trial import Outcome, carry_out
from daq.lifeline import end_with_parent, leave_signals_to_parent
from estimator import result_lines
from robot_drivers.errors import DeviceError

_LOOK_S = 0.5
_MOST_TRIES = 2


@dataclass(frozen=True, slots=True)
class Abandoned:
    """A run that could not be carried out to its end, twice, and why: no outcome, but no success either."""

    run: int
    why: str


def fault_of(run: int, faults: Sequence[Fault]) -> Fault:
    """Return the fault of a run: each in turn, so that all come equally often."""
    return faults[run % len(faults)]


def named(labels: Sequence[str]) -> tuple[Fault, ...]:
    """Return the faults whose labels contain one of the words, all for none.

    Raises
    ------
    DaqError
        No label contains one of them.
    """
    for word in labels:
        if not any(word in fault.label for fault in FAULTS):
            raise DaqError(f"no fault is called {word!r}; `retract faults --list` tells their names")
    return tuple(fault for fault in FAULTS if not labels or any(word in fault.label for word in labels))


def read_results(path: Path, seed: int) -> dict[int, Outcome]:
    """Return the outcomes of a campaign of this seed that a file holds, by run; a line that was cut off is left out.

    Raises
    ------
    InputError
        The file holds something else.
    """
    outcomes = result_lines.read_results(Outcome, path)
    return {outcome.run: outcome for outcome in outcomes if outcome.seed == seed}


def keep(path: Path, outcome: Outcome) -> None:
    """Append an outcome to a file of results; what was cut off there before is ended first."""
    path.parent.mkdir(parents=True, exist_ok=True)
    result_lines.append_result(path, outcome)


def carry_out_all(
    seed: int, runs: Sequence[int], faults: Sequence[Fault], jobs: int
) -> Iterator[Outcome | Abandoned]:
    """Carry out these runs on as many rigs at once as there are ``jobs``; yield what came of each as it ends.

    Raises
    ------
    DaqError
        The processes of the campaign have died.
    """
    context = multiprocessing.get_context("spawn")
    waiting: Any = context.Queue()
    done: Any = context.Queue()
    for run in runs:
        waiting.put((run, fault_of(run, faults).label))
    for _ in range(jobs):
        waiting.put(None)
    workers = [context.Process(target=_work, args=(seed, waiting, done)) for _ in range(jobs)]
    for worker in workers:
        worker.start()
    try:
        for _ in runs:
            yield _next_result(done, workers)
    finally:
        for worker in workers:
            worker.terminate()
            worker.join()


def _next_result(done: Any, workers: Sequence[BaseProcess]) -> Outcome | Abandoned:
    while True:
        try:
            result = done.get(timeout=_LOOK_S)
        except queue.Empty:
            if not any(worker.is_alive() for worker in workers):
                raise DaqError(
                    "the processes of the campaign have ended early; see their messages above"
                ) from None
            continue
        assert isinstance(result, Outcome | Abandoned)
        return result


def _work(seed: int, waiting: Any, done: Any) -> None:
    """Carry out runs until there are no more; a rig on which one could not be carried out is replaced."""
    leave_signals_to_parent()  # which ends this
    end_with_parent()
    by_label = {fault.label: fault for fault in FAULTS}
    with Stage(seed) as stage:
        while (asked := waiting.get()) is not None:
            run, label = asked
            for attempt in range(1, _MOST_TRIES + 1):
                try:
                    done.put(stage.carry_out(run, by_label[label]))
                    break
                except (DaqError, DeviceError, OSError, ValueError) as error:
                    traceback.print_exc()
                    if attempt == _MOST_TRIES:
                        done.put(Abandoned(run, f"{label}: could not be carried out: {error}"))


class Stage:
    """A rig and a client that go from run to run, as a laboratory does; a context manager.

    After a run that ended otherwise than it must, both are made anew, so that one defect is not found again and again.
    """

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._things = ExitStack()
        self._bench: Bench | None = None
        self._client: Client | None = None

    def carry_out(self, run: int, fault: Fault) -> Outcome:
        """Carry out one run.

        Raises
        ------
        DaqError, DeviceError, OSError, ValueError
            It could not be carried out to its end.
        """
        try:
            with tempfile.TemporaryDirectory(prefix="faults-", ignore_cleanup_errors=True) as folder:
                rig = self._rig(run)
                outcome = carry_out(rig, self._client_for(fault, rig), fault, Path(folder), self._seed, run)
        except BaseException:
            self._clear()
            raise
        if outcome.next_failure:
            self._clear()
        return outcome

    def _rig(self, run: int) -> Bench:
        if self._bench is None:
            folder = self._things.enter_context(
                tempfile.TemporaryDirectory(prefix="faults-rig-", ignore_cleanup_errors=True)
            )
            self._bench = self._things.enter_context(bench(Path(folder), self._seed + run))
        return self._bench

    def _client_for(self, fault: Fault, rig: Bench) -> Client:
        if type(self._client) is not fault.client:
            client, self._client = self._client, None
            if client is not None:
                client.close()
            self._client = fault.client(rig)
        return self._client

    def _clear(self) -> None:
        client, self._client, self._bench = self._client, None, None
        try:
            if client is not None:
                client.close()
        finally:
            self._things.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._clear()


def single_run(seed: int, run: int, fault: Fault) -> Outcome:
    """Carry out one run on a rig of its own."""
    with Stage(seed) as stage:
        return stage.carry_out(run, fault)
