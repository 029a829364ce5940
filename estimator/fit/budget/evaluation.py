"""The budget of a finished fit: every component's contribution, and what a smaller one would be worth.

The estimate stays as it is, with its weights: half a source leaves a quarter of what it gives to the variance. A fit
that is told of a smaller noise weighs the measurements anew; as far as it knows of all errors it does better still.
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.fit.budget.budget import Budget, DeviceLine, Line
from estimator.fit.budget.components import Component
from estimator.fit.budget.source import DEVICES
from estimator.inference.free_parameter import FreeParameter

FloatArray = NDArray[np.float64]

# What half a source takes off its share in the variance.
_HALVED = 0.75


def budget_of(
    free: Sequence[FreeParameter], components: Sequence[Component], left_out: Sequence[str] = ()
) -> Budget:
    """Evaluate a budget.

    Parameters
    ----------
    free : the p parameters at their final values
    components : all sources; each is independent of the others
    left_out : in words, what could not be evaluated
    """
    names, slopes = [p.name for p in free], np.array([p.slope for p in free])
    covariances = [one.spread @ one.spread.T for one in components]
    total = _sum(covariances, len(free))

    def named(values: FloatArray) -> dict[str, float]:
        return dict(zip(names, values.tolist(), strict=True))

    def deviations(covariance: FloatArray) -> dict[str, float]:
        return named(slopes * np.sqrt(np.maximum(np.diag(covariance), 0.0)))

    def shares(covariance: FloatArray) -> dict[str, float]:
        return named(np.diag(covariance) / np.diag(total))

    lines = [
        Line(
            one.source,
            named(slopes * _sensitivity(one)),
            deviations(covariance),
            shares(covariance),
            halved=deviations(total - _HALVED * covariance),
            gone=deviations(total - covariance),
        )
        for one, covariance in zip(components, covariances, strict=True)
    ]
    of_device = {
        device: _sum(
            (c for one, c in zip(components, covariances, strict=True) if one.source.device == device),
            len(free),
        )
        for device in DEVICES
        if any(one.source.device == device for one in components)
    }
    devices = [
        DeviceLine(device, shares(c), deviations(total - _HALVED * c), deviations(total - c))
        for device, c in of_device.items()
    ]
    known = (c for one, c in zip(components, covariances, strict=True) if one.source.known)
    return Budget(
        values={p.name: p.value for p in free},
        symbols={p.name: p.label for p in free},
        units={p.name: p.unit for p in free},
        lines=tuple(sorted(lines, key=lambda line: -_most(line.share))),
        devices=tuple(sorted(devices, key=lambda one: -_most(one.share))),
        combined=deviations(total),
        known=deviations(_sum(known, len(free))),
        correlation=float(total[0, 1] / np.sqrt(total[0, 0] * total[1, 1])) if len(names) > 1 else 0.0,
        left_out=tuple(left_out),
    )


def _most(share: Mapping[str, float]) -> float:
    return max(share.values())


def _sum(covariances: Iterable[FloatArray], size: int) -> FloatArray:
    return sum(covariances, start=np.zeros((size, size)))


def _sensitivity(component: Component) -> FloatArray:
    """Return by how much (p,) a unit of the source moves the parameters."""
    change, size = np.sqrt(np.sum(component.spread**2, axis=1)), component.source.size
    return np.asarray(change / size if size > 0 else np.zeros_like(change))
