"""Worker processes on this computer, for work that does not depend on each other."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager

from threadpoolctl import threadpool_limits


@contextmanager
def worker_pool(processes: int | None = None) -> Iterator[Executor]:
    """Give workers, one a core by default, each with one thread in its linear algebra.

    What waits is given up where the block is left early. The workers end with the process that made them, also where
    that is killed.
    """
    count = processes or os.cpu_count() or 1
    pool = ProcessPoolExecutor(count, mp_context=multiprocessing.get_context("spawn"), initializer=_begin)
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)


def _begin() -> None:
    # Ctrl-C ends a worker at once and without a word: the parent tells what happened.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    threadpool_limits(1)
    threading.Thread(target=_end_with_parent, name="lifeline", daemon=True).start()


def _end_with_parent() -> None:
    # A worker waits for its next task on a pipe of which its siblings hold the other end too: nothing tells it there.
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
