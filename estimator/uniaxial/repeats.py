"""Whether two runs of one test differ by more than repeats do, and if so, in what.

A second run is held against the first: by a stress that is lower or higher in proportion (the modulus: softened, or
another specimen), by a zero of strain that lies elsewhere (slack), or by a steeper end of the curve (stiffening). The
size of each is found in every other block of strain and judged in the blocks between; what no laboratory would care
for is no effect.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from estimator.errors import InputError
from estimator.uniaxial.law_fit import FloatArray
from estimator.uniaxial.records import UniaxialRecord

NONE, UNKNOWN = "none", "unknown"

_POINTS, _BLOCKS = 200, 10
_LEAST_CLOSURE = 0.5
# Runs of one specimen come back to within this share of the stress.
_REPEATABILITY = 0.03


@dataclass(frozen=True, slots=True)
class _Change:
    """What an effect does to a curve of stress (n,) over magnitudes of strain (n,), per unit of its amplitude."""

    derivative: Callable[[FloatArray, FloatArray], FloatArray]
    smallest: float
    unit: str


def _in_proportion(strain: FloatArray, stress: FloatArray) -> FloatArray:
    return stress


def _shifted(strain: FloatArray, stress: FloatArray) -> FloatArray:
    return -np.gradient(stress, strain)


def _steeper(strain: FloatArray, stress: FloatArray) -> FloatArray:
    return np.asarray(stress * (strain / strain[-1]) ** 2)


_CHANGES: Mapping[str, _Change] = MappingProxyType(
    {
        "modulus": _Change(_in_proportion, 0.05, "share of the stress"),
        "slack": _Change(_shifted, 0.01, "strain"),
        "strain_stiffening": _Change(_steeper, 0.05, "share of the stress at the largest strain"),
    }
)


@dataclass(frozen=True, slots=True)
class Comparison:
    """One run held against another.

    Attributes
    ----------
    first, second : names of the records
    verdict : "none", an effect, or "unknown": a difference that no effect explains
    size, unit : of the effect that explains most; by "none" smaller than anybody would care for
    gap : root mean square difference over root mean square stress
    closure_held_out : share of the gap that this effect takes away in the blocks of strain left out
    """

    first: str
    second: str
    verdict: str
    size: float
    unit: str
    gap: float
    closure_held_out: float


def compare_runs(first: UniaxialRecord, second: UniaxialRecord) -> Comparison:
    """Hold a second run against the first.

    Raises
    ------
    InputError
        One is a tensile test and the other a compression test.
    """
    if first.mode != second.mode:
        raise InputError(
            f"{second.name} is a {second.mode} test and {first.name} one in {first.mode}; compare runs of one test"
        )
    reach = min(np.abs(first.strain).max(), np.abs(second.strain).max())
    strain = np.linspace(0.02, 1.0, _POINTS) * reach
    before, after = _curve(first, strain), _curve(second, strain)
    difference = after - before
    gap = float(np.sqrt(np.mean(difference**2) / np.mean(before**2)))
    found = {
        name: _explained(change.derivative(strain, before), difference) for name, change in _CHANGES.items()
    }
    name = max(found, key=lambda each: found[each][1])
    (size, closure), change = found[name], _CHANGES[name]
    return Comparison(
        first.name, second.name, _verdict(name, size, closure, gap), size, change.unit, gap, closure
    )


def _verdict(name: str, size: float, closure: float, gap: float) -> str:
    if gap < _REPEATABILITY or (closure >= _LEAST_CLOSURE and abs(size) < _CHANGES[name].smallest):
        return NONE
    return name if closure >= _LEAST_CLOSURE else UNKNOWN


def _curve(record: UniaxialRecord, strain: FloatArray) -> FloatArray:
    """Return the magnitude of stress at magnitudes of strain that rise; a strain measured twice by its mean."""
    magnitude, inverse = np.unique(np.abs(record.strain), return_inverse=True)
    stress = np.bincount(inverse, np.abs(record.stress)) / np.bincount(inverse)
    return np.asarray(np.interp(strain, magnitude, stress))


def _explained(derivative: FloatArray, difference: FloatArray) -> tuple[float, float]:
    """Return the amplitude from all blocks, and the closure in blocks that did not determine it."""
    block = np.arange(len(difference)) * _BLOCKS // len(difference)
    left = np.empty_like(difference)
    for parity in (0, 1):
        fitted, held_out = block % 2 == parity, block % 2 != parity
        amplitude = _amplitude(derivative[fitted], difference[fitted])
        left[held_out] = difference[held_out] - amplitude * derivative[held_out]
    before = np.sqrt(np.mean(difference**2))
    closure = 0.0 if before == 0 else float(1 - np.sqrt(np.mean(left**2)) / before)
    return _amplitude(derivative, difference), closure


def _amplitude(derivative: FloatArray, difference: FloatArray) -> float:
    return float(derivative @ difference / (derivative @ derivative))
