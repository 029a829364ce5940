"""Cases that cost no time to compute, in a module that worker processes can import."""

import multiprocessing
import os
import signal
import time
from dataclasses import dataclass

from estimator.studies.running.case import Parametric, Row


@dataclass(frozen=True)
class Sleeping(Parametric):
    """Sleeps, and finds its own number."""

    number: int
    seconds: float = 0.0

    @property
    def name(self) -> str:
        return f"sleeping {self.number}"

    def run(self) -> Row:
        time.sleep(self.seconds)
        return {
            "youngs_modulus": float(self.number),
            "poisson_ratio": 0.45,
            "seconds": self.seconds,
            "process": os.getpid(),
        }


@dataclass(frozen=True)
class Fatal(Parametric):
    """Takes its worker with it."""

    name: str = "fatal"

    def run(self) -> Row:
        if multiprocessing.parent_process() is None:
            raise RuntimeError("this is no worker, and stays")
        os.kill(os.getpid(), signal.SIGKILL)
        return {}
