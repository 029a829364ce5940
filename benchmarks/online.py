"""The estimate while a retraction runs: what each step of the Pull costs on the default mesh.

All of it: the estimate, and the earlier step that is solved anew after it.
"""

from collections.abc import Iterator
from functools import partial

from benchmarks.pull import PULL, Timing, timed, unknowns
from estimator.fit.online import Following, OnlineEstimate, Rows, advance, follow_from, renewed, standing_rows
from estimator.forward.meshing import mesh_experiment
from estimator.studies.paper_tables.block import measured


def lines() -> Iterator[str]:
    """Give a line for each step once there is an estimate, and one for the slowest of them."""
    problem = mesh_experiment(PULL)
    recorded = measured(PULL, problem)
    yield f"estimate after each step of the Pull, default mesh, {unknowns(problem)} unknowns:"
    following, timings = follow_from(recorded), []
    for rows in standing_rows(recorded):
        following, timing = timed(partial(_step, following, rows))
        if following.estimate is not None:
            timings.append(timing)
            yield f"  {_told(following.estimate)}; {timing}"
    slowest = Timing(max(t.wall_s for t in timings), max(t.cpu_s for t in timings))
    yield f"slowest step: {slowest} (< 0.3 s)"


def _step(following: Following, rows: Rows) -> Following:
    return renewed(advance(following, rows))


def _told(found: OnlineEstimate) -> str:
    modulus, ratio = (found.parameters[name].value for name in ("youngs_modulus", "poisson_ratio"))
    return f"step {found.step}: E {modulus / 1e3:.3f} kPa, nu {ratio:.4f}"
