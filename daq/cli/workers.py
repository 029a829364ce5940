"""The option that sends cases to a cluster, and the workers that the options of a verb ask for."""

import argparse
from functools import partial

from estimator.cluster import dask_cluster
from estimator.errors import InputError
from estimator.workers import Workers, worker_pool


def add_scheduler_option(parser: argparse.ArgumentParser) -> None:
    """Add the address of a Dask scheduler."""
    parser.add_argument(
        "--scheduler",
        metavar="tcp://HOST:PORT",
        help="send the cases to the workers of this Dask scheduler; a case whose worker is lost goes to another",
    )


def workers_of(scheduler: str | None, processes: int | None, option: str) -> Workers:
    """Return what starts the workers: those of a scheduler, or so many processes, by default one a core.

    Parameters
    ----------
    option : that gave ``processes``

    Raises
    ------
    InputError
        The number of processes is none.
    """
    if processes is not None and processes < 1:
        raise InputError(f"{option} {processes}: at least one is needed")
    return partial(dask_cluster, scheduler) if scheduler else partial(worker_pool, processes)
