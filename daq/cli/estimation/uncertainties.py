"""What a command line tells of uncertainties that the model does not have: options of estimation and of budgets."""

import argparse
from collections.abc import Sequence

from daq.rig import Rig
from daq.uncertainties import stated_by_calibrations
from estimator.errors import InputError
from estimator.fit.budget.source import Origin
from estimator.fit.budget.systematic import SYSTEMATIC, Stated


def add_uncertainty_option(parser: argparse.ArgumentParser) -> None:
    """Add the option that states sizes."""
    known = ", ".join(f"{one.name} ({_unit(one.unit)}{one.assumed:g})" for one in SYSTEMATIC.values())
    parser.add_argument(
        "--uncertainty",
        action="append",
        default=[],
        metavar="NAME=SIZE",
        help="standard uncertainty for the budget, SI units, in place of what calibrations tell or is assumed; repeat "
        f"for several; of {known}",
    )


def stated_of(texts: Sequence[str], rig: Rig | None) -> Stated:
    """Return what the options state, and for the rest what the calibrations of a rig found.

    Raises
    ------
    InputError
        An option is not written as its help says, or names what there is not.
    RigError
        A calibration file cannot be read.
    """
    found = Stated() if rig is None else stated_by_calibrations(rig)
    given: dict[str, float] = {}
    for text in texts:
        name, _, number = text.partition("=")
        try:
            given[name] = float(number)
        except ValueError:
            raise InputError(f"--uncertainty {text}: write it as NAME=NUMBER, in SI units") from None
    try:
        return Stated(
            {**found.sizes, **given},
            {**found.origins, **dict.fromkeys(given, Origin("B", "stated by --uncertainty"))},
        )
    except InputError as error:
        raise InputError(f"--uncertainty: {error}") from None


def _unit(unit: str) -> str:
    return "" if unit == "1" else f"{unit}, "
