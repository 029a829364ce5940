"""How soon the estimate of a running session is shown: from the end of a step's measuring window to its numbers.

The real window records a standard pull of the emulated phantom, all devices at full rate, and follows it on its page
Estimate. The emulated devices, the phantom's solution, the recorder and the estimation share this computer.

Usage::

    python -m gui.promptness
"""

import argparse
import json
import multiprocessing
import os
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from daq.errors import DaqError, SessionError
from daq.rig import read_rig
from daq.virtual_rig.launch import virtual_rig
from daq.virtual_rig.processes import VirtualRigSettings
from daq.virtual_rig.standard import standard_settings
from gui.app import Desk
from gui.pages.acquire import AcquirePage
from gui.pages.estimate import EstimatePage
from gui.rehearsal import application_without_display, wait_for, wait_until
from gui.theme import LIGHT

_LONGEST_S = 1.0
_PATIENCE_S = 300.0
_PREPARING_S = 15.0


@dataclass(frozen=True, slots=True)
class Promptness:
    """What a run measured.

    Attributes
    ----------
    steps : of the session, without the one at rest
    shown_s : for each step whose estimate was shown, its number and the time since its measuring window ended
    load_average : of the machine, over the last minute
    """

    steps: int
    shown_s: tuple[tuple[int, float], ...]
    load_average: float

    @property
    def passed(self) -> bool:
        """Whether every step was shown, within a second."""
        late_s = [late_s for _, late_s in self.shown_s]
        return len(late_s) == self.steps and max(late_s) < _LONGEST_S

    def __str__(self) -> str:
        late_s = dict(self.shown_s)
        told = [late_s.get(step) for step in range(1, self.steps + 1)]
        lines = [
            f"  {step:4d}  {'not shown' if late is None else f'{late:9.2f} s'}"
            for step, late in enumerate(told, start=1)
        ]
        known = list(late_s.values()) or [float("nan")]
        return "\n".join(
            [
                f"E and ν with intervals after each of {self.steps} steps, load {self.load_average:.1f}",
                "  step  shown after its end",
                *lines,
                f"  {len(late_s)} of {self.steps} shown: median {np.median(known):.2f} s, worst {max(known):.2f} s "
                f"(bar: all within {_LONGEST_S:g} s): {'passed' if self.passed else 'FAILED'}",
            ]
        )


def run(settings: VirtualRigSettings, folder: Path) -> Promptness:
    """Record a standard pull in the window, follow it, and measure.

    Raises
    ------
    SessionError
        The recording did not end well.
    """
    with virtual_rig(folder, settings, in_real_time=True) as running:
        rig = read_rig(running.rig_path)
        desk = Desk(rig, folder / "sessions")
        desk.open()
        assert desk.window is not None
        assert desk.context is not None
        link = desk.context.link
        link.open(rig)
        wait_until(lambda: link.state.tool is not None, "a connected rig", _PATIENCE_S)
        acquire, estimate = desk.window.page(AcquirePage), desk.window.page(EstimatePage)
        shown: list[tuple[int, float]] = []
        estimate.step_shown.connect(lambda step, late_s: shown.append((step, late_s)))
        estimate.follow.setChecked(True)
        acquire.trial_panel.choose("pull")
        steps = len(acquire.trial_panel.trajectory().steps) - 1
        # as an operator does: the box is ticked, then the retraction chosen, and what both need is loaded meanwhile
        desk.window.show_page("Acquire")
        wait_for(_PREPARING_S)
        acquire.start_button.click()
        desk.window.show_page("Estimate")
        wait_until(lambda: acquire.runner.running, "the beginning of the session", _PATIENCE_S)
        wait_until(lambda: not acquire.runner.running, "the end of the session", _PATIENCE_S)
        entry = acquire.runner.queue[-1]
        # the estimation of the whole session, which follows, is not waited for
        wait_until(
            lambda: len(shown) >= steps or estimate.strip.idle, "the estimates of its steps", _PATIENCE_S
        )
        desk.end()
    if entry.state != "done":
        raise SessionError(f"the pull has ended early: {entry.remark}")
    return Promptness(steps, tuple(shown), os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan"))


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure; exit status 1 when an estimate came later than a second after its step, 2 without a whole pull."""
    parser = argparse.ArgumentParser(prog="python -m gui.promptness", description=main.__doc__)
    parser.add_argument(
        "--rate", type=int, default=7000, help="of the force sensor, Hz (default: %(default)s)"
    )
    parser.add_argument(
        "--frames", type=float, default=25.0, help="of each camera, 1/s (default: %(default)s)"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    options = parser.parse_args(arguments)
    # its processes import what this program does, which those of ``python -m gui`` need not
    multiprocessing.set_forkserver_preload(["gui.analysis.following", "gui.app"])
    settings = replace(standard_settings(), force_rate_hz=options.rate, frames_per_s=options.frames)
    try:
        with application_without_display(LIGHT), tempfile.TemporaryDirectory(prefix="promptness-") as folder:
            result = run(settings, Path(folder))
    except (DaqError, TimeoutError) as error:
        sys.stderr.write(f"gui.promptness: {error}\n")
        return 2
    sys.stdout.write(f"{json.dumps(asdict(result)) if options.json else result}\n")
    return 0 if result.passed else 1


if __name__ == "__main__":
    sys.exit(main())
