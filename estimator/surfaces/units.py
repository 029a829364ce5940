"""The unit of length of a surface file, which most formats do not state."""

from collections.abc import Mapping
from typing import Literal, get_args

from estimator.errors import InputError

Unit = Literal["mm", "cm", "m", "inch"]
UNITS: tuple[Unit, ...] = get_args(Unit)
METRES: Mapping[Unit, float] = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "inch": 0.0254}

# Longest edges of the bounding box that a phantom can have.
_PLAUSIBLE_SIZE_M = (2e-3, 2.0)
# From so many units on only the millimetre gives a phantom of usual size; below, it may be another unit as well.
_SURELY_MILLIMETRES = 60.0


def unit_of(longest: float, stated: Unit | None, source: str) -> tuple[Unit, str | None]:
    """Return the unit of a surface, and what to say where it was told from the size.

    Parameters
    ----------
    longest : edge of the bounding box, in the file's unit
    stated : what the user says; None to tell it from the size
    source : file, as messages name it

    Raises
    ------
    InputError
        No unit, or not the stated one, gives a phantom; or several do.
    """
    fitting = [
        unit for unit in UNITS if _PLAUSIBLE_SIZE_M[0] <= longest * METRES[unit] <= _PLAUSIBLE_SIZE_M[1]
    ]
    if stated is not None:
        if stated not in fitting:
            raise InputError(
                f"{source}: the surface is {longest:g} {stated} long, and phantoms are 0.002 to 2 m; "
                f"state its unit{_possible(longest, fitting)}"
            )
        return stated, None
    if "m" in fitting:
        return "m", None
    if longest >= _SURELY_MILLIMETRES and "mm" in fitting:
        return "mm", f"taken as millimetres by its size: {longest:g} mm long"
    raise InputError(
        f"{source}: the surface is {longest:g} m long if it is in metres, and phantoms are 0.002 to 2 m; "
        f"state its unit{_possible(longest, fitting)}"
    )


def _possible(longest: float, fitting: list[Unit]) -> str:
    if not fitting:
        return ", or export it again: no unit of " + ", ".join(UNITS) + " makes it one"
    sizes = ", ".join(f"{unit} ({longest * METRES[unit]:.3g} m)" for unit in fitting)
    return f": {sizes} would do (retract mesh --unit, or unit under [phantom] of an experiment)"
