"""Worker processes for solves that do not depend on each other."""

import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

from threadpoolctl import threadpool_limits


def worker_pool(processes: int | None = None) -> ProcessPoolExecutor:
    """Return a pool of workers, one a core by default, each with one thread in its linear algebra."""
    count = processes or os.cpu_count() or 1
    return ProcessPoolExecutor(count, mp_context=get_context("spawn"), initializer=_single_threaded)


def _single_threaded() -> None:
    threadpool_limits(1)
