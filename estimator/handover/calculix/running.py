"""Run CalculiX on a deck and read its answer."""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from pathlib import Path

from estimator.errors import SolverError
from estimator.handover.answer import EngineAnswer
from estimator.handover.calculix.results import read_answer
from estimator.handover.model import HandedOver, Run

# Debian calls it ccx; the project's own builds have the version behind.
_PROGRAMS = ("ccx", "ccx_2.20", "ccx_2.21", "ccx_2.22", "ccx_2.23")


def program() -> str | None:
    """Return CalculiX's solver, None where it is not installed."""
    return next((found for name in _PROGRAMS if (found := shutil.which(name))), None)


def run_deck(ccx: str, deck: Path, handed: HandedOver, run: Run) -> EngineAnswer:
    """Run a deck, and return what CalculiX answers; its files stay beside the deck.

    Raises
    ------
    SolverError
        It ends with an error, which the message tells.
    """
    started = time.perf_counter()
    environment = {"OMP_NUM_THREADS": "1", **os.environ}
    log = deck.with_suffix(".log")
    with log.open("w", encoding="utf-8") as file:
        done = subprocess.run(
            [ccx, deck.stem],
            cwd=deck.parent,
            stdout=file,
            stderr=subprocess.STDOUT,
            env=environment,
            check=False,
        )
    text = log.read_text(encoding="utf-8", errors="replace")
    errors = [line.strip() for line in text.splitlines() if "*ERROR" in line]
    if done.returncode or errors:
        raise SolverError(f"{log}: CalculiX ends with status {done.returncode}: {' '.join(errors[:2])}")
    return read_answer(deck.with_suffix(".dat"), handed, run, time.perf_counter() - started)
