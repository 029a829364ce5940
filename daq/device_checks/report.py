"""What the checks of a rig's devices say."""

from dataclasses import dataclass, field

from robot_drivers.protocols import DeviceIdentity


@dataclass(frozen=True, slots=True)
class Check:
    """One property of a device; ``told`` is what was found, and where ``passed`` is not, what was expected."""

    name: str
    passed: bool
    told: str


@dataclass(frozen=True, slots=True)
class DeviceReport:
    """What the checks of one device say; ``identity`` is None where it did not answer."""

    role: str
    identity: DeviceIdentity | None
    checks: tuple[Check, ...] = field(default=())

    @property
    def passed(self) -> bool:
        """Whether every check passed."""
        return all(check.passed for check in self.checks)
