"""Which threads of this process are new: those of other tests, which may end at any time, do not count."""

import threading
from collections.abc import Callable


def new_threads() -> Callable[[], int]:
    """Return what counts the threads that live and did not when this was called."""
    before = set(threading.enumerate())
    return lambda: len(set(threading.enumerate()) - before)
