"""What an engine is to a handover: a writer of its files, a runner where it is installed, a reader of its answers."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Protocol

from estimator.fem.discretisation.block_mesh import Grading
from estimator.handover.answer import EngineAnswer
from estimator.handover.model import Able, HandedOver, Run, Tell


class Engine(Able, Protocol):
    """A simulator that a phantom is handed over to."""

    @property
    def grading(self) -> Grading:
        """Element sizes of the mesh that it gets."""

    def missing(self) -> str:
        """Return why it cannot be run here; empty where it can."""

    def version(self) -> str:
        """Return which one would be run, empty where none is installed."""

    def differs(self, handed: HandedOver) -> tuple[str, ...]:
        """Return in what its model is another than ours, a sentence each."""

    def write(self, handed: HandedOver, folder: Path) -> list[Path]:
        """Write its files into a folder, and return them, those of an experiment in the order of the runs."""

    def run(self, handed: HandedOver, folder: Path, tell: Tell) -> list[EngineAnswer]:
        """Run what was written, and return its answer to every run.

        Raises
        ------
        SolverError
            It finds no equilibrium.
        """


def file_stem(run: Run, number: int) -> str:
    """Return a name for an experiment's files that every file system and engine takes."""
    return f"{number + 1:02d}_" + re.sub(r"[^A-Za-z0-9]+", "_", run.experiment.name).strip("_").lower()[:40]
