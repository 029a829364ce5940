"""The picture of a soak: memory, threads, handles, latencies, blocks and images shown, against time."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from gui.soak.meter import LONGEST_BLOCK_S, Second
from robot_drivers.protocols import FloatArray

_MOST_POINTS = 600
_WINDOW, _RECORDER = "window", "recorder"


def plot_soak(seconds: Sequence[Second], page: Path) -> None:
    """Draw what was measured into a PNG file; raises OSError where that cannot be written."""
    minutes = np.array([second.time_s for second in seconds]) / 60.0
    duration_s = np.array([second.duration_s for second in seconds])
    figure = Figure(figsize=(9.0, 12.0), layout="constrained")
    memory, held, late, block, shown = figure.subplots(5, 1, sharex=True)
    memory.plot(minutes, [second.window.memory_mib for second in seconds], label=_WINDOW)
    memory.plot(minutes, [second.recorder.memory_mib for second in seconds], label=_RECORDER)
    memory.set_ylabel("memory, MiB")
    held.plot(minutes, [second.window.threads for second in seconds], label=f"threads, {_WINDOW}")
    held.plot(minutes, [second.recorder.threads for second in seconds], label=f"threads, {_RECORDER}")
    held.plot(minutes, [second.window.handles for second in seconds], "--", label=f"handles, {_WINDOW}")
    held.plot(minutes, [second.recorder.handles for second in seconds], "--", label=f"handles, {_RECORDER}")
    held.set_ylabel("number")
    late.plot(minutes, [1e3 * second.window_late_s for second in seconds], ".", markersize=3, label=_WINDOW)
    late.plot(
        minutes, [1e3 * second.recorder_late_s for second in seconds], ".", markersize=3, label=_RECORDER
    )
    late.set_ylabel("latency, ms")
    late.set_yscale("log")
    block.plot(minutes, [1e3 * second.block_s for second in seconds], ".", markersize=3, label="block")
    block.plot(minutes, [1e3 * second.work_s for second in seconds], ".", markersize=3, label="of it work")
    block.axhline(1e3 * LONGEST_BLOCK_S, color="tab:red", linewidth=1.0)
    block.set_ylabel("interface thread, ms")
    block.set_yscale("log")
    for camera in sorted({name for second in seconds for name in second.images}):
        counts = np.array([second.images.get(camera, 0) for second in seconds])
        shown.plot(*_averaged(minutes, counts / duration_s), label=f"{camera} camera")
    shown.set_ylabel("images shown, 1/s")
    shown.set_xlabel("time, min")
    for axes in (memory, held, shown):
        axes.set_ylim(bottom=0.0)
    for axes in (memory, held, late, block, shown):
        axes.grid(alpha=0.3)
        if axes.get_legend_handles_labels()[0]:
            axes.legend(loc="lower left", ncols=2)
    figure.savefig(page, dpi=120)


def _averaged(minutes: FloatArray, rates: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return means of neighbours, few enough for the eye."""
    parts = max(1, min(_MOST_POINTS, len(minutes) // 5))
    together = [np.array_split(values, parts) for values in (minutes, rates)]
    return np.array([part.mean() for part in together[0]]), np.array([part.mean() for part in together[1]])
