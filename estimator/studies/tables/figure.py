"""One figure that a paper gives beside ours."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Figure:
    """What the paper gives for one estimation, or for the mean of several; None is what it leaves out.

    Attributes
    ----------
    youngs_modulus_pa, poisson_ratio : estimated
    seconds : prescaling and minimisation
    iterations, calls : of the minimisation, and of its function
    rmse_fiducials_m, rmse_force_n : root mean square errors
    scatter : relative standard deviations of these over the draws, by their names
    """

    youngs_modulus_pa: float
    poisson_ratio: float
    seconds: float | None = None
    iterations: int | None = None
    calls: int | None = None
    rmse_fiducials_m: float | None = None
    rmse_force_n: float | None = None
    scatter: Mapping[str, float] = field(default_factory=dict)
