"""What went wrong, as it crosses between processes: every error of the laboratory and of a device keeps its class."""

import sys
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Failure:
    """An error: its class, by which the other process knows it too, and its one line."""

    kind: type[Exception]
    message: str


def failure_of(error: Exception) -> Failure:
    """Return an error as it is reported: by its class, or the nearest above it that another process can import."""
    return Failure(next(filter(_is_importable, type(error).__mro__)), str(error))


def error_of(failure: Failure) -> Exception:
    """Return the error that was reported, to be raised; what it carried beside its message stays behind."""
    error = failure.kind.__new__(failure.kind)  # its constructor may want more than a message
    error.args = (failure.message,)
    return error


def _is_importable(kind: type) -> bool:
    module = sys.modules.get(kind.__module__)
    return kind.__module__ != "__main__" and getattr(module, kind.__qualname__, None) is kind
