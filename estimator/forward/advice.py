"""What would help where a motion has no equilibrium."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from estimator.errors import SolverError
from estimator.experiment import Experiment
from estimator.experiment.support import is_loose_sheet


@contextmanager
def advising(experiments: Sequence[Experiment]) -> Iterator[None]:
    """Say with a failure to find an equilibrium what of the experiments may be the reason.

    Raises
    ------
    SolverError
        As what is computed within.
    """
    try:
        yield
    except SolverError as failure:
        if any(
            experiment.phantom.stays_flat is False and is_loose_sheet(experiment)
            for experiment in experiments
        ):
            raise SolverError(
                f"{failure}; a loose sheet wrinkles: if it stays in its plane, write stays_flat = true in [phantom]"
            ) from failure
        raise
