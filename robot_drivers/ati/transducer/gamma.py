"""The ATI Gamma transducer in its calibration SI-130-10, and one real unit's calibration.

The certificate of the unit in use overrides everything here.
"""

from collections.abc import Sequence

import numpy as np

from robot_drivers.specification import ForceSensorSpecification, Six

RATED_WRENCH = (130.0, 130.0, 400.0, 10.0, 10.0, 10.0)
"""Rated range, ± N for Fx Fy Fz and ± N·m for Tx Ty Tz."""

GAGE_MATRIX = np.array(
    [
        [-1.395115, 6.06166, -86.49169, -4247.508, -12.23112, 4223.725],
        [-25.79711, 4918.066, -42.36156, -2453.942, -1.432269, -2445.755],
        [7571.881, 108.7123, 7652.86, 21.27031, 7602.011, 60.34784],
        [0.4456577, 59.43468, -220.4258, -30.04249, 219.9759, -27.8555],
        [253.174, 3.163722, -125.4127, 51.15543, -127.074, -51.90575],
        [0.1613185, -133.4189, -2.528893, -133.9306, 0.7586892, -133.654],
    ]
)
"""Calibration of unit FT33206: rows Fx Fy Fz Tx Ty Tz, columns gages 0..5, 1e-6 N or N·m per gage count."""

GAGE_NOISE_STD = (0.0060, 0.0060, 0.0132, 0.00032, 0.00032, 0.00023)
"""Standard deviation (N, N·m) that white noise of one gage count on every gage gives through that matrix."""


def noise_std(rated_wrench: Sequence[float]) -> Six:
    """Return the noise (6,), N and N·m, of a transducer of this rated range, if a count is the Gamma's share of it."""
    parts = zip(GAGE_NOISE_STD, rated_wrench, RATED_WRENCH, strict=True)
    fx, fy, fz, tx, ty, tz = (noise * rated / gamma for noise, rated, gamma in parts)
    return (fx, fy, fz, tx, ty, tz)


def specification(rated_wrench: Six, rate_hz: float | None, host: str = "") -> ForceSensorSpecification:
    """Return what a transducer of this rated range is, with the noise that a Gamma has in its range."""
    return ForceSensorSpecification(
        host=host, rated_wrench=rated_wrench, noise_std=noise_std(rated_wrench), rate_hz=rate_hz
    )
