"""One forward Pull and whole estimations against the peer, in one run on one machine."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator

from benchmarks.felupe_peer import FelupePull, estimate_by_slsqp
from benchmarks.pull import PULL, Timing, fastest, fastest_of_each, solve_pull, timed, unknowns
from estimator.studies.paper_tables.block import TRUTH, measured
from estimator.studies.paper_tables.densities import CELLS
from estimator.studies.paper_tables.figures import TABLE_I
from estimator.studies.paper_tables.fitting import fitted
from estimator.studies.paper_tables.tetrahedra import block_of_tetrahedra

_REPEATS = 6
_FIRST_STATE = (
    "from benchmarks.pull import PULL, solve_pull; from estimator.studies.paper_tables.block import TRUTH; "
    "from estimator.studies.paper_tables.tetrahedra import block_of_tetrahedra; "
    "solve_pull(block_of_tetrahedra(PULL, (4, 4, 1)), TRUTH)"
)


def lines() -> Iterator[str]:
    """Give the figures, with what they are held to; ratios are of processor time, in one thread on both sides."""
    low, high = (block_of_tetrahedra(PULL, CELLS[density]) for density in ("low", "high"))
    peer = FelupePull(low)
    ours, theirs = fastest_of_each((lambda: solve_pull(low, TRUTH), lambda: peer.solve(TRUTH)), _REPEATS)
    yield f"one forward Pull, {len(low.body.mesh.cells)} linear tetrahedra, {unknowns(low)} unknowns, ten steps:"
    yield f"  {ours}; FElupe with CHOLMOD {theirs}: ratio {theirs.cpu_s / ours.cpu_s:.1f} (>= 3)"

    data = measured(PULL, high)
    estimation = fastest(lambda: fitted(low, [data]), _REPEATS)
    found = fitted(low, [data])
    yield f"two-parameter estimation there: {estimation} = {estimation.cpu_s / ours.cpu_s:.1f} forward Pulls (<= 4)"
    yield (
        f"  E {found.youngs_modulus.value / 1e3:.3f} kPa, nu {found.poisson_ratio.value:.4f}, "
        f"{found.forward_solves} states"
    )
    before = peer.runs
    (modulus, ratio), slsqp = timed(lambda: estimate_by_slsqp(peer, data))
    yield f"the peer's, SLSQP and finite differences: {slsqp}: ratio {slsqp.cpu_s / estimation.cpu_s:.0f} (>= 30)"
    yield f"  E {modulus / 1e3:.3f} kPa, nu {ratio:.4f}, {peer.runs - before} forward Pulls"

    yield f"case 2 of the paper: {estimation} (<= 1.5 s); the paper {TABLE_I['case 2'].seconds:.0f} s"
    dear = fastest(lambda: fitted(high, [data]), 1)
    yield (
        f"case 1 of the paper, {len(high.body.mesh.cells)} linear tetrahedra, {unknowns(high)} unknowns: "
        f"{dear} (<= 6 s); the paper {TABLE_I['case 1'].seconds:.0f} s"
    )
    compiled, cached = _start_up()
    yield f"start-up to a first solution: {compiled} with compilation, {cached} from the cache (< 5 s)"


def _start_up() -> tuple[Timing, Timing]:
    """Return the times of a process that solves something small, without and with a cache of compiled functions."""
    times = []
    with tempfile.TemporaryDirectory() as cache:
        for _ in range(2):
            wall, before = time.perf_counter(), os.times()
            command = [sys.executable, "-c", _FIRST_STATE]
            subprocess.run(command, check=True, env={**os.environ, "NUMBA_CACHE_DIR": cache})
            after = os.times()
            cpu = after.children_user + after.children_system - before.children_user - before.children_system
            times.append(Timing(time.perf_counter() - wall, cpu))
    return times[0], times[1]
