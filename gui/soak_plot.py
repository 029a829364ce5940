"""The picture of a soak: memory, blocks of the interface thread, images shown, threads and handles, against time."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from gui.soak_meter import LONGEST_BLOCK_S, Second

_MOST_POINTS = 600


def plot_soak(seconds: Sequence[Second], page: Path) -> None:
    """Draw what was measured into a PNG file; raises OSError where that cannot be written."""
    minutes = np.array([second.time_s for second in seconds]) / 60.0
    duration_s = np.array([second.duration_s for second in seconds])
    figure = Figure(figsize=(9.0, 9.0), layout="constrained")
    memory, block, shown, resources = figure.subplots(4, 1, sharex=True)
    memory.plot(minutes, [second.memory_mib for second in seconds])
    memory.set_ylabel("memory, MiB")
    block.plot(minutes, [1e3 * second.block_s for second in seconds], ".", markersize=3, label="block")
    block.plot(minutes, [1e3 * second.work_s for second in seconds], ".", markersize=3, label="of it work")
    block.axhline(1e3 * LONGEST_BLOCK_S, color="tab:red", linewidth=1.0)
    block.set_ylabel("interface thread, ms")
    block.set_yscale("log")
    block.legend(loc="upper right")
    for camera in sorted({name for second in seconds for name in second.images}):
        counts = np.array([second.images.get(camera, 0) for second in seconds])
        shown.plot(*_averaged(minutes, counts / duration_s), label=f"{camera} camera")
    shown.set_ylabel("images shown, 1/s")
    shown.set_ylim(bottom=0.0)
    shown.legend(loc="lower left")
    resources.plot(minutes, [second.threads for second in seconds], label="threads")
    resources.plot(minutes, [second.handles for second in seconds], label="open files and sockets")
    resources.set_ylim(bottom=0)
    resources.set_xlabel("time, min")
    resources.legend(loc="lower left")
    for axes in (memory, block, shown, resources):
        axes.grid(alpha=0.3)
    figure.savefig(page, dpi=120)


def _averaged(minutes: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return means of neighbours, few enough for the eye."""
    parts = max(1, min(_MOST_POINTS, len(minutes) // 5))
    together = [np.array_split(values, parts) for values in (minutes, rates)]
    return np.array([part.mean() for part in together[0]]), np.array([part.mean() for part in together[1]])
