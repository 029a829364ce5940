"""Workers for tasks that do not depend on each other: processes of this computer, and what runs on any workers."""

import contextlib
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import (
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    as_completed,
)
from contextlib import AbstractContextManager, contextmanager
from multiprocessing.connection import Connection
from typing import TypeAlias, TypeVar

from threadpoolctl import threadpool_limits

from estimator.errors import WorkersLostError

# Starts workers, and ends them where the block is left.
Workers: TypeAlias = Callable[[], AbstractContextManager[Executor]]

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


def run_each(
    workers: Workers, task: Callable[[_Item], _Result], items: Sequence[_Item]
) -> Iterator[tuple[_Item, _Result]]:
    """Give each item with the result of its task as soon as there is one; without items no worker is started.

    Parameters
    ----------
    workers : starts them
    task : a function at the top of a module, which other processes can find

    Raises
    ------
    WorkersLostError
        A worker died. Like an interruption and the error of a task, it comes after the results that were there.
    """
    if not items:
        return
    with workers() as pool:
        waiting: dict[Future[_Result], _Item] = {pool.submit(task, item): item for item in items}
        try:
            for job in as_completed(list(waiting)):
                result = job.result()
                yield waiting.pop(job), result
        except (KeyboardInterrupt, Exception) as stop:
            for job, item in waiting.items():
                if not job.cancel() and job.done() and not job.cancelled() and job.exception() is None:
                    yield item, job.result()
            if isinstance(stop, BrokenExecutor):
                raise WorkersLostError(f"a worker died ({stop})") from stop
            raise


@contextmanager
def worker_pool(processes: int | None = None) -> Iterator[Executor]:
    """Give workers, one a core by default, each with one thread in its linear algebra, as the process that gives them.

    A second thread there would take a core from a worker, most of the time to wait for the next product.

    What waits is given up where the block is left early, and where it is interrupted what is under way too. The workers
    end with the process that made them, also where that is killed. A process that may have no children, as the workers
    of a cluster may not, works by itself.
    """
    if multiprocessing.current_process().daemon:
        with threadpool_limits(1), ThreadPoolExecutor(1) as alone:
            yield alone
        return
    count = processes or os.cpu_count() or 1
    context = multiprocessing.get_context("spawn")
    watched, lifeline = context.Pipe(duplex=False)
    pool = ProcessPoolExecutor(count, mp_context=context, initializer=_begin, initargs=(watched,))
    try:
        with threadpool_limits(1):
            yield pool
    except (KeyboardInterrupt, GeneratorExit):
        lifeline.close()
        raise
    finally:
        pool.shutdown(cancel_futures=True)
        lifeline.close()
        watched.close()


def _begin(lifeline: Connection) -> None:
    # Ctrl-C ends a worker at once and without a word: the parent tells what happened.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    threadpool_limits(1)
    # it waits for its next task on a pipe of which its siblings hold the other end too: nothing tells it there
    threading.Thread(target=_wait_for_end, args=(lifeline,), name="lifeline", daemon=True).start()


def _wait_for_end(lifeline: Connection) -> None:
    with contextlib.suppress(EOFError, OSError):
        lifeline.recv()
    os._exit(1)
