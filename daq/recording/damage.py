"""What parsing raises on bytes of a recording that cannot be right, told as one error."""

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import zstandard
from mcap.exceptions import McapError

from daq.errors import RecordingError

_OF_DAMAGE = (
    McapError,
    zstandard.ZstdError,
    struct.error,
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    ArithmeticError,
    RecursionError,
)


@contextmanager
def telling_damage(file: Path) -> Iterator[None]:
    """Raise RecordingError, which names the file, for whatever a parser stumbles over meanwhile."""
    try:
        yield
    except RecordingError as error:
        told = str(error)
        raise (error if str(file) in told else RecordingError(f"{file}: {told}")) from error
    except _OF_DAMAGE as error:
        raise RecordingError(
            f"{file}: holds a message that no recorder writes ({error!r}); restore it from a copy"
        ) from error
