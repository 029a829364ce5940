"""Worker processes on this computer, for work that does not depend on each other."""

import contextlib
import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing.connection import Connection

from threadpoolctl import threadpool_limits


@contextmanager
def worker_pool(processes: int | None = None) -> Iterator[Executor]:
    """Give workers, one a core by default, each with one thread in its linear algebra, as the process that gives them.

    A second thread there would take a core from a worker, most of the time to wait for the next product.

    What waits is given up where the block is left early, and where it is interrupted what is under way too. The workers
    end with the process that made them, also where that is killed.
    """
    count = processes or os.cpu_count() or 1
    context = multiprocessing.get_context("spawn")
    watched, lifeline = context.Pipe(duplex=False)
    pool = ProcessPoolExecutor(count, mp_context=context, initializer=_begin, initargs=(watched,))
    try:
        with threadpool_limits(1):
            yield pool
    except KeyboardInterrupt:
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
