"""What the settings of drivers are checked for alike, whatever the device."""

import math

from robot_drivers.errors import ConfigurationError
from robot_drivers.specification import Six


def check_positive(settings: object, device: str, *names: str) -> None:
    """Refuse a setting that is no positive, finite number; None, which leaves it to the device, is none to refuse.

    Parameters
    ----------
    settings : of a driver
    device : what the message says that they are of
    names : of the settings to check

    Raises
    ------
    ConfigurationError
        Naming the first that cannot be.
    """
    for name in names:
        value = getattr(settings, name)
        if value is not None and not (math.isfinite(value) and value > 0):
            raise ConfigurationError(f"{device} {name} {value}: must be positive")


def check_rated_wrench(rated_wrench: Six | None) -> None:
    """Refuse a range, ± N and N·m, that is not positive; None is one that the device tells, or nobody.

    Raises
    ------
    ConfigurationError
        A component is not positive.
    """
    if rated_wrench is not None and not all(rated > 0 for rated in rated_wrench):
        raise ConfigurationError(f"force sensor rated_wrench {rated_wrench}: must be positive")
