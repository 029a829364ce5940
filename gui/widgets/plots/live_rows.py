"""The last seconds of a stream, as rows of time and values, in a buffer of fixed size."""

import numpy as np

from robot_drivers.protocols import FloatArray


class LiveRows:
    """Keeps the newest rows.

    Parameters
    ----------
    most : rows that are kept
    width : of a row; its first entry is the host time in s
    """

    def __init__(self, most: int, width: int) -> None:
        self._rows = np.empty((2 * most, width))
        self._most = most
        self._end = 0

    def add(self, rows: FloatArray) -> None:
        """Add rows (n, width), the oldest first."""
        rows = rows[-self._most :]
        if self._end + len(rows) > len(self._rows):
            kept = self.all()
            self._rows[: len(kept)] = kept
            self._end = len(kept)
        self._rows[self._end : self._end + len(rows)] = rows
        self._end += len(rows)

    def clear(self) -> None:
        """Forget all rows."""
        self._end = 0

    def all(self) -> FloatArray:
        """Return a copy of the rows (n, width), the oldest first."""
        kept: FloatArray = self._rows[max(0, self._end - self._most) : self._end].copy()
        return kept
