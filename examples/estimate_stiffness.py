"""Estimate how stiff a tissue is, from a folder of one experiment; without one, from a simulated pull.

python examples/estimate_stiffness.py experiments/pull
python examples/estimate_stiffness.py
"""

import sys
from pathlib import Path
from typing import Any, Literal

import numpy as np

from estimator import Experiment, estimate, read_experiment, simulate

Mesh = Literal["fine", "coarse"]


def simulated(steps: int = 6, mesh: Mesh = "fine") -> Experiment:
    """Return a pull by 2 mm a step on a phantom of 15 kPa."""
    displacement_m = np.outer(np.arange(steps + 1), [2e-3, 0.0, 0.0])
    (measured,) = simulate(Experiment.of_block(displacement_m), youngs_modulus=15e3, seed=1, mesh=mesh)
    return measured


def main(measured: Experiment, figure: Path, **asked: Any) -> float:
    """Print the estimate, draw it beside the measured wrench, and return Young's modulus, Pa.

    ``asked`` goes to :func:`estimator.estimate`.
    """
    found = estimate(measured, **asked)
    for name, one in found.parameters.items():
        print(f"{name} = {one.value:.5g}, 95 % between {one.interval95[0]:.5g} and {one.interval95[1]:.5g}")
    found.plot("wrench").savefig(figure)
    return found.youngs_modulus.value


if __name__ == "__main__":
    main(read_experiment(sys.argv[1]) if len(sys.argv) > 1 else simulated(), Path("estimate.png"))
