"""What went wrong, as it crosses between processes: every error of the laboratory and of a device keeps its class."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Failure:
    """An error: its class, by which the other process knows it too, and its one line."""

    kind: type[Exception]
    message: str


def failure_of(error: Exception) -> Failure:
    """Return an error as it is reported."""
    return Failure(type(error), str(error))


def error_of(failure: Failure) -> Exception:
    """Return the error that was reported, to be raised; what it carried beside its message stays behind."""
    error = failure.kind.__new__(failure.kind)  # its constructor may want more than a message
    error.args = (failure.message,)
    return error
