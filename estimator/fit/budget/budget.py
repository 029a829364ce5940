"""What a budget says: each source with its share, all of them together, and what would become of these without it."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from estimator.fit.budget.source import Device, Source
from estimator.inference.normal import Z95


@dataclass(frozen=True, slots=True)
class Line:
    """A source and what it contributes, by name of the parameter, in the parameter's unit.

    Attributes
    ----------
    source : what it is
    sensitivity : |c|, c = ∂y/∂x by the source's unit; of one with several components the root of the sum of squares
    contribution : |c| u(x), standard deviation
    share : of the combined variance
    halved, gone : combined standard uncertainty if the source were half as large, and if it were gone
    """

    source: Source
    sensitivity: Mapping[str, float]
    contribution: Mapping[str, float]
    share: Mapping[str, float]
    halved: Mapping[str, float]
    gone: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class DeviceLine:
    """All sources of a device; attributes as those of :class:`Line`."""

    device: Device
    share: Mapping[str, float]
    halved: Mapping[str, float]
    gone: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Budget:
    """The uncertainty budget of an estimate; all values by name of the parameter, in its unit.

    Attributes
    ----------
    values : that were estimated
    symbols, units : of the parameters; an empty unit is that of a pure number
    lines : the sources, the largest share in any parameter first
    devices : the same by device
    combined : standard uncertainty
    known : the part of it that the fit knows of: the standard deviation that the estimate tells
    correlation : of the first two parameters; 0 where there is one
    left_out : in words, errors of the geometry with which the motion has no equilibrium
    """

    values: Mapping[str, float]
    symbols: Mapping[str, str]
    units: Mapping[str, str]
    lines: tuple[Line, ...]
    devices: tuple[DeviceLine, ...]
    combined: Mapping[str, float]
    known: Mapping[str, float]
    correlation: float
    left_out: tuple[str, ...] = ()
    coverage_factor: float = Z95

    @property
    def expanded(self) -> dict[str, float]:
        """Expanded uncertainty U = k u: an interval of about 95 %."""
        return {name: self.coverage_factor * value for name, value in self.combined.items()}

    def first_to_improve(self, parameter: str) -> DeviceLine:
        """Return the device of which halved uncertainties would help a parameter most."""
        return min(self.devices, key=lambda one: one.halved[parameter])

    def as_json(self) -> dict[str, Any]:
        """Return all of it in plain values; SI units."""
        return {**asdict(self), "expanded": self.expanded}
