"""What the checks find suspicious, told beside an answer that it may have spoiled, or beside a failure to find one."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from estimator.errors import FitError, SolverError
from estimator.experiment_checks.checking import check_folder

# A value that is known or was not measured mostly spoils nothing.
_HARMLESS = ("constant column",)


def suspicions_of(folders: Sequence[Path | str]) -> list[str]:
    """Return a line for each kind of suspicious finding: where it is first found, what it is, what to do.

    Raises
    ------
    InputError
        A folder is neither an experiment nor one of several.
    """
    first: dict[str, str] = {}
    for checked in (one for folder in folders for one in check_folder(folder)):
        for finding in checked.findings:
            if finding.grade == "suspicious" and finding.check not in _HARMLESS:
                place = f"{checked.folder}/{finding.where}"
                first.setdefault(finding.check, f"{place}: {finding.what}; {finding.do}")
    return list(first.values())


@contextmanager
def naming_suspicions(folders: Sequence[Path | str]) -> Iterator[None]:
    """Say with a fit that fails, or a motion without equilibrium, what the checks find suspicious first.

    Raises
    ------
    FitError, SolverError
        As what is computed within.
    """
    try:
        yield
    except (FitError, SolverError) as failure:
        if found := suspicions_of(folders):
            raise type(failure)(f"{failure}; suspicious in {found[0]}") from failure
        raise
