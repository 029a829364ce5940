"""A case of a study: pure, seeded and picklable, so that it gives the same row wherever and whenever it runs."""

from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from typing import Protocol

from threadpoolctl import threadpool_limits

from estimator.errors import EstimatorError

# What a case finds: ``youngs_modulus`` in Pa, ``poisson_ratio``, ``seconds``, and where there is something to say a
# ``remark``; numbers and text alone, so that it can be kept as JSON.
Row = Mapping[str, float | str]

# To be raised when the same case shall give another row.
_GENERATION = 1


class Case(Protocol):
    """One run from a truth, or from a recording, to an estimate."""

    @property
    def name(self) -> str:
        """In words, for progress."""

    @property
    def identity(self) -> str:
        """Everything that the row depends on."""

    def run(self) -> Row:
        """Return the row; raises EstimatorError where there is none."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a case: its row, or why there is none."""

    row: Row | None
    failure: str = ""


class Parametric:
    """A case whose fields say everything that its row depends on."""

    @property
    def identity(self) -> str:
        """The case as it is written in Python."""
        return repr(self)


def digest(case: Case) -> str:
    """Return a name for a case that no other case has."""
    return sha256(f"{_GENERATION} {case.identity}".encode()).hexdigest()[:20]


def run_case(case: Case) -> Outcome:
    """Run a case in one thread of linear algebra: the cases keep the cores busy."""
    with threadpool_limits(1):
        try:
            return Outcome(case.run())
        except EstimatorError as error:
            return Outcome(None, str(error))
