"""What other installed packages add, found by the entry points that they declare (``importlib.metadata``)."""

from collections.abc import Iterable
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points

from estimator.errors import InputError


@dataclass(frozen=True, slots=True)
class Plugin:
    """What one entry point brings.

    Attributes
    ----------
    group, name : of the entry point
    package : that declares it, with its version
    value : what it names
    """

    group: str
    name: str
    package: str
    value: object

    def refused(self, why: str) -> InputError:
        """Return the complaint that tells the package, what is wrong, and what helps."""
        return InputError(
            f"package {self.package}, entry point '{self.name}' of {self.group}: {why}; repair the package or "
            "uninstall it"
        )


def plugins(group: str) -> tuple[Plugin, ...]:
    """Return what the installed packages bring to a group, by package and name.

    Raises
    ------
    InputError
        What an entry point names cannot be imported.
    """
    return loaded(entry_points(group=group))


def loaded(points: Iterable[EntryPoint]) -> tuple[Plugin, ...]:
    """Return what entry points name, by package and name.

    Raises
    ------
    InputError
        As :func:`plugins`.
    """
    found = []
    for point in points:
        package = "of an unknown name" if point.dist is None else f"{point.dist.name} {point.dist.version}"
        empty = Plugin(point.group, point.name, package, None)
        try:
            value = point.load()
        except Exception as error:
            raise empty.refused(f"cannot be imported: {type(error).__name__}: {error}") from error
        found.append(Plugin(point.group, point.name, package, value))
    return tuple(sorted(found, key=lambda plugin: (plugin.package, plugin.name)))
