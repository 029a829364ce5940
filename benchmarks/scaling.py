"""Time and memory of one state against the number of unknowns, each mesh in a process of its own."""

import math
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import pairwise
from multiprocessing import get_context

from benchmarks.pull import POSES, PULL, timed, unknowns
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.equilibrium.newton import EquilibriumSolver
from estimator.fem.equilibrium.state import EquilibriumState
from estimator.forward.meshing import mesh_experiment
from estimator.studies.paper_tables.block import TRUTH

if sys.platform != "win32":
    import resource

_SIZES_M = (3e-3, 2e-3, 1e-3, 0.6e-3, 0.44e-3)
_LAYERS = (1, 1, 2, 3, 3)


def lines() -> Iterator[str]:
    """Give a line for each mesh, and the exponent between neighbours."""
    yield "hex27, rest and first step of the Pull, seconds of one core:"
    yield "unknowns, meshing, solution, peak memory in MB, exponent of the solution"
    found = []
    for size, layers in zip(_SIZES_M, _LAYERS, strict=True):
        with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
            found.append(process.submit(_measure, size, layers).result())
        count, meshing, solution, peak = found[-1]
        line = f"{count:8d} {meshing:8.2f} {solution:8.2f} {peak:8.0f}"
        if len(found) > 1:
            ((before, _, earlier, _), _) = next(iter(pairwise(found[-2:])))
            line += f" {math.log(solution / earlier) / math.log(count / before):8.2f}"
        yield line


def _measure(size_m: float, layers: int) -> tuple[int, float, float, float]:
    """Return unknowns, processor seconds of meshing and of the solution of one step, and peak memory, MB."""
    _solve(3e-3, 1)  # what is compiled or loaded once
    return _solve(size_m, layers)


def _solve(size_m: float, layers: int) -> tuple[int, float, float, float]:
    grading = Grading(grasp_m=size_m, anchor_m=2 * size_m, largest_m=8 * size_m, growth=1.6, layers=layers)
    problem, meshing = timed(partial(mesh_experiment, PULL, grading))
    _, solution = timed(partial(_first_step, problem))
    return unknowns(problem), meshing.cpu_s, solution.cpu_s, _peak_memory_mb()


def _first_step(problem: RetractionProblem) -> EquilibriumState:
    solver = EquilibriumSolver(problem)
    return solver.solve(POSES[1], TRUTH, solver.rest(TRUTH))


def _peak_memory_mb() -> float:
    """Return the most memory that this process has had, NaN on Windows, which does not tell it."""
    if sys.platform == "win32":
        return math.nan
    kilobytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return kilobytes / (1024.0**2 if sys.platform == "darwin" else 1024.0)
