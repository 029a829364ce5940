"""What else runs beside a control loop: a plot that is drawn again and again, and a file that is written to."""

import os
import tempfile
import time
from multiprocessing.synchronize import Event

import numpy as np

_FRAME_S = 0.05
_BLOCK_S = 0.02
_BLOCK_BYTES = 256 * 1024
_FILE_BYTES = 64 * 1024 * 1024


def plot(ended: Event) -> None:
    """Draw six channels of ten seconds, twenty times a second."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    random = np.random.default_rng(0)
    figure, axes = pyplot.subplots(2, 3)
    lines = [axis.plot(random.standard_normal(2500))[0] for axis in axes.flat]
    while not ended.wait(_FRAME_S):
        for line in lines:
            line.set_ydata(random.standard_normal(2500))
        figure.canvas.draw()


def write(ended: Event) -> None:
    """Write some 13 MB/s to a file, on disk once a second, and begin it anew at 64 MB."""
    block = os.urandom(_BLOCK_BYTES)
    with tempfile.TemporaryFile() as file:
        synced_s = time.monotonic()
        while not ended.wait(_BLOCK_S):
            file.write(block)
            if file.tell() > _FILE_BYTES:
                file.seek(0)
            if time.monotonic() - synced_s > 1.0:
                file.flush()
                os.fsync(file.fileno())
                synced_s = time.monotonic()
