"""What a command line tells of uncertainties that the model does not have: options of estimation and of budgets."""

import argparse
from collections.abc import Sequence

from daq.rig import Rig
from daq.uncertainties import stated_by_calibrations
from estimator.errors import InputError
from estimator.experiment.model import BEAD_CHANNELS, WRENCH_CHANNELS
from estimator.fit.budget.source import Origin
from estimator.fit.budget.systematic import SYSTEMATIC, Stated

_NOISY = {
    "force_std": "force",
    "torque_std": "torque",
    "fiducial_std": "bead",
    "position_std": "position",
    **dict.fromkeys(WRENCH_CHANNELS[:3], "force"),
    **dict.fromkeys(WRENCH_CHANNELS[3:], "torque"),
    **dict.fromkeys(BEAD_CHANNELS, "bead"),
}


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


def stated_of(options: argparse.Namespace, rig: Rig | None) -> Stated:
    """Return what ``--uncertainty`` and ``--noise`` state, and for the rest what the calibrations of a rig found.

    Raises
    ------
    InputError
        An option is not written as its help says, or names what there is not.
    RigError
        A calibration file cannot be read.
    """
    found = Stated() if rig is None else stated_by_calibrations(rig)
    given: dict[str, float] = {}
    for text in options.uncertainty:
        name, _, number = text.partition("=")
        try:
            given[name] = float(number)
        except ValueError:
            raise InputError(f"--uncertainty {text}: write it as NAME=NUMBER, in SI units") from None
    try:
        return Stated(
            {**found.sizes, **given},
            {
                **found.origins,
                **dict.fromkeys(given, Origin("B", "stated by --uncertainty")),
                **dict.fromkeys(_noisy(options.noise), Origin("B", "stated by --noise")),
            },
        )
    except InputError as error:
        raise InputError(f"--uncertainty: {error}") from None


def _noisy(texts: Sequence[str]) -> set[str]:
    """Return the kinds of noise of which ``--noise`` states a deviation."""
    return {_NOISY[name] for name in (text.partition("=")[0] for text in texts) if name in _NOISY}


def _unit(unit: str) -> str:
    return "" if unit == "1" else f"{unit}, "
