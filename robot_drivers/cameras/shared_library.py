"""A shared library of the system through ctypes, its functions declared as its headers say."""

import ctypes
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from robot_drivers.errors import ConfigurationError

Signature = tuple[Any, tuple[Any, ...]]
"""What a function returns and what it takes, types of ctypes; None for nothing."""


@dataclass(frozen=True, slots=True)
class Need:
    """Who needs a library: the driver, what the library is called, and the package of Debian that holds it."""

    driver: str
    library: str
    package: str


class SharedLibrary:
    """A loaded library.

    Parameters
    ----------
    name : of the shared library, or its path
    need : what to tell where it cannot be loaded
    signatures : of the functions that are called, by name

    Raises
    ------
    ConfigurationError
        There is no such library, or it lacks one of the functions.
    """

    def __init__(self, name: str, need: Need, signatures: Mapping[str, Signature]) -> None:
        try:
            self._library = ctypes.CDLL(name)
        except OSError as error:
            raise _missing(need, error) from error
        self.declare(signatures, need)

    def declare(self, signatures: Mapping[str, Signature], need: Need) -> None:
        """Declare further functions that are called; raises ConfigurationError where the library lacks one of them."""
        try:
            for function, (result, arguments) in signatures.items():
                declared = getattr(self._library, function)
                declared.restype, declared.argtypes = result, arguments
        except AttributeError as error:
            raise _missing(need, error) from error

    def plain(self, function: str, *arguments: Any) -> Any:
        """Call a function, and return what it returns."""
        return getattr(self._library, function)(*arguments)


def _missing(need: Need, error: Exception) -> ConfigurationError:
    return ConfigurationError(
        f"the {need.driver} camera driver needs {need.library}, which cannot be loaded ({error}): install it "
        f"(Debian: sudo apt install {need.package}), or set library to where it is"
    )
