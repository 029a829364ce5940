"""What would help where a motion has no equilibrium."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from estimator.errors import SolverError
from estimator.experiment import Experiment
from estimator.experiment.support import KEEPS_FLAT, is_loose_sheet


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
        if any(is_loose_sheet(experiment) for experiment in experiments):
            raise SolverError(f"{failure}; a loose sheet wrinkles: {KEEPS_FLAT}") from failure
        raise
