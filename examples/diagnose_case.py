"""Ask what causes the gap between model and measurement, of a folder of experiments; without one, of a simulated case.

python examples/diagnose_case.py cases/P07
python examples/diagnose_case.py
"""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from estimator import Experiment, diagnose, read_case, simulate


def simulated(steps: int = 6, mesh: Literal["fine", "coarse"] = "fine") -> list[Experiment]:
    """Return a pull and a turning pull, seen by cameras whose scale is 2 % off."""
    way = np.outer(np.arange(steps + 1), [12e-3 / steps, 0.0, 0.0])
    turn = np.outer(np.arange(steps + 1), [0.0, 0.0, 0.4 / steps])
    planned = [
        Experiment.of_block(way, name="pull", order=1),
        Experiment.of_block(way, turn, name="turning_pull", order=2),
    ]
    return simulate(planned, effects=["camera_scale=0.02"], seed=1, mesh=mesh)


def main(measured: Sequence[Experiment], figure: Path) -> tuple[str, ...]:
    """Print the verdict and the likeliest answers, draw them, and return the labels of the causes."""
    found = diagnose(measured, progress=lambda stage, done, total: print(f"  {stage}: {done} of {total}"))
    print(found)
    for answer, probability in list(found.probabilities.items())[:5]:
        print(f"  {answer}: {probability:.3f}")
    found.plot("causes").savefig(figure)
    return found.verdict


if __name__ == "__main__":
    main(read_case(sys.argv[1]) if len(sys.argv) > 1 else simulated(), Path("causes.png"))
