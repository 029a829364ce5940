"""Statistics of the columns of a LeRobot dataset, by which programs of robot learning scale them.

Each column has ``min``, ``max``, ``mean``, ``std``, ``count`` and five quantiles, of an image for each of its channels
in values from 0 to 1. Those of a whole dataset are computed of all its frames, not of its episodes' statistics: a
quantile of the whole is no mean of quantiles.
"""

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from robot_drivers.protocols import FloatArray

Statistics: TypeAlias = dict[str, NDArray[Any]]

_QUANTILES = (0.01, 0.10, 0.50, 0.90, 0.99)
MOST_IMAGES = 60
"""Images of an episode that its statistics are taken of, evenly spread."""


def statistics(values: NDArray[Any]) -> Statistics:
    """Return the statistics of a column (n, ...), each of the shape of a row; a scalar has that of one number."""
    rows = values.reshape(len(values), -1)
    found: Statistics = {
        "min": rows.min(axis=0),
        "max": rows.max(axis=0),
        "mean": rows.mean(axis=0, dtype=np.float64),
        "std": rows.std(axis=0, dtype=np.float64),
        "count": np.array([len(rows)]),
    }
    for share in _QUANTILES:
        found[f"q{round(100 * share):02d}"] = np.quantile(rows.astype(np.float64), share, axis=0)
    return found


class ImageStatistics:
    """Gathers how often each value is in each channel of images, so that nothing else of them need be kept."""

    def __init__(self) -> None:
        self._counts = np.zeros((3, 256), np.int64)
        self._images = 0

    def add(self, rgb: NDArray[np.uint8]) -> None:
        """Count the values of an image (height, width, 3)."""
        self._images += 1
        for channel in range(3):
            self._counts[channel] += np.bincount(rgb[..., channel].ravel(), minlength=256)

    def with_all_of(self, other: "ImageStatistics") -> None:
        """Count the values of images that were counted elsewhere."""
        self._counts += other._counts
        self._images += other._images

    def result(self) -> Statistics:
        """Return the statistics, (3, 1, 1) each."""
        levels = np.arange(256) / 255.0
        total = self._counts.sum(axis=1)
        share = self._counts / total[:, None]
        mean = share @ levels
        below = np.cumsum(share, axis=1)
        found: dict[str, FloatArray] = {
            "min": levels[np.argmax(self._counts > 0, axis=1)],
            "max": levels[255 - np.argmax(self._counts[:, ::-1] > 0, axis=1)],
            "mean": mean,
            "std": np.sqrt(np.maximum(share @ levels**2 - mean**2, 0.0)),
        }
        for quantile in _QUANTILES:
            found[f"q{round(100 * quantile):02d}"] = levels[np.argmax(below >= quantile, axis=1)]
        shaped: Statistics = {name: values.reshape(3, 1, 1) for name, values in found.items()}
        return {**shaped, "count": np.array([self._images])}


def joined(columns: Sequence[Mapping[str, NDArray[Any]]]) -> dict[str, NDArray[Any]]:
    """Return the columns of several episodes end to end."""
    return {name: np.concatenate([one[name] for one in columns]) for name in columns[0]}
