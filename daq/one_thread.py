"""One thread for a computation beside devices.

The libraries below NumPy and OpenCV share even small work among as many threads as there are processors, and wait for
the slowest. Where a recording keeps the processors busy such a thread waits for its turn: a step of the running
estimation then takes two to three times as long, and finding the beads of an image five times.
"""

import cv2
from threadpoolctl import threadpool_limits


def compute_in_one_thread() -> None:
    """Let the libraries of this process compute in the thread that calls them, from now on."""
    cv2.setNumThreads(1)
    threadpool_limits(1)
