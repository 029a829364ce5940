"""Where strain and stress begin: slack that the machine takes up first, and load that the specimen bears already.

Slack is the strain up to which rows bear no load, though the test moves: the zero of strain lies at its end (toe
compensation, as in ASTM D638, annex A1). It is found as the kink of a curve that is flat before and a cubic behind.
Stress at zero strain is either a preload, so that the specimen is stretched already, or an offset of the load cell; a
Neo-Hookean curve tells which. A curve that merely begins softly is left as it is: that may be the material.
"""

from dataclasses import dataclass

import numpy as np

from estimator.uniaxial.loading import noise_of
from estimator.uniaxial.records import FloatArray, Mode

_FEWEST_FLAT = 3
_BEGINNING = 5  # rows that tell where a record starts
_NEGLIGIBLE = 2e-3  # misfit, of the range of stress
_FLAT = 0.1  # slope before the kink, over the one right behind it
_LEAST_SLACK = 2e-3  # of strain
_FARTHEST = 0.25  # strain behind the kink that a cubic follows
_CANDIDATES = 200
_KINK = 0.5  # slope right behind it, over the one up to the end
_SIGNIFICANT = 20.0  # F of one further parameter
_SURE = 4.0  # standard errors
_LEAST_STRESS = 0.01  # of the stress at the end of the range
_PRELOADS = 400
_TOES = (0.0, 0.01, 0.02, 0.04, 0.08)


@dataclass(frozen=True, slots=True)
class Slack:
    """A flat beginning.

    Attributes
    ----------
    strain : at its end
    stress : that the load cell reads along it
    toe : strain behind it in which the curve bends into its course
    """

    strain: float
    stress: float
    toe: float


@dataclass(frozen=True, slots=True)
class Preload:
    """Stress at zero strain.

    Attributes
    ----------
    stress : at zero strain
    strain : that the specimen bears there already; 0 where the load cell has an offset
    """

    stress: float
    strain: float


def find_slack(strain: FloatArray, stress: FloatArray) -> Slack | None:
    """Find a beginning without load.

    Parameters
    ----------
    strain, stress : (n,) magnitudes of the first loading, rows before it moved included
    """
    onset = _onset(strain, stress)
    if onset < _FEWEST_FLAT:
        return None
    begin, start, reach = float(strain[0]), float(strain[onset]), float(strain.max())
    used = strain <= start + min(_FARTHEST, (reach - start) / 2)
    if used.sum() < onset + 2 * _BEGINNING:
        used = strain <= reach
    x, y = strain[used], stress[used]
    none_cost, _ = _hinge(x, y, begin, 0.0)
    noise = noise_of(y)
    best: tuple[float, float, FloatArray, float] | None = None
    for toe in _TOES:
        if start + toe >= reach:
            break
        candidates = np.linspace(begin, start, _CANDIDATES)
        fits = [(*_hinge(x, y, float(kink), toe), float(kink)) for kink in candidates]
        cost, values, kink = min(fits, key=lambda one: one[0])
        if best is None or cost < 0.5 * best[1]:
            best = (kink, cost, values, toe)
        if np.sqrt(cost) <= max(2 * noise, _NEGLIGIBLE * float(np.ptp(y))):
            break
    if best is None:
        return None
    kink, cost, values, toe = best
    flat = int(np.sum(x < kink))
    end = float(x.max()) - kink
    secant = float(_cubic(values, np.array(end))) / end if end > 0 else 0.0
    significant = none_cost > cost * (1 + _SIGNIFICANT / len(x))
    if flat < _FEWEST_FLAT or abs(kink) < _LEAST_SLACK:
        return None
    if not significant or secant <= 0 or values[1] < _KINK * secant or toe > kink - begin:
        return None
    before = x < kink - toe
    # rows at one strain and the next far behind it, as in a staircase, do not tell where between them load began
    if float(x[x < kink].max()) - begin < (kink - begin) / 2:
        return None
    if _slope(x[before], y[before]) > _FLAT * values[1]:
        return None
    return Slack(kink, float(values[0]), toe)


def find_preload(strain: FloatArray, stress: FloatArray, mode: Mode, reach: float) -> Preload | None:
    """Find stress at zero strain.

    Parameters
    ----------
    strain, stress : (n,) magnitudes of the first loading, without slack
    reach : strain up to which a law will be fitted
    """
    # as far as laws are judged: the two causes differ in the curve's further course only
    used = strain <= min(2 * reach, float(strain.max()))
    x, y = strain[used], stress[used]
    # a record that begins later does not tell what was at zero
    if len(x) < 2 * _BEGINNING or x[0] > 0.02 * float(x.max()):
        return None
    beginning = x <= max(min(_FARTHEST, float(x.max())), float(x[2 * _BEGINNING - 1]))
    values, errors = _polynomial(x[beginning], y[beginning])
    offset = float(values[0])
    if abs(offset) < _SURE * errors[0] or abs(offset) < _LEAST_STRESS * float(y.max()):
        return None
    # what is read there, too, and not only where a curve that begins softly would come from
    if abs(float(np.median(y[:_BEGINNING] - _cubic(values, x[:_BEGINNING]))) - offset) > 0.3 * abs(offset):
        return None
    if offset < 0:
        return Preload(offset, 0.0)
    constant_cost, _ = _solved(np.stack([_neo_hookean(x, mode), np.ones_like(x)], axis=1), y)
    slope = float(values[1])
    largest = min(4 * offset / slope, 0.5) if slope > 0 else 0.0
    shifts = np.linspace(0.0, largest, _PRELOADS)[1:]
    costs = [_solved(_neo_hookean(x + shift, mode)[:, None], y)[0] for shift in shifts]
    best = int(np.argmin(costs)) if costs else 0
    if not costs or constant_cost < costs[best]:
        return Preload(offset, 0.0)
    return Preload(offset, float(shifts[best]))


def _onset(strain: FloatArray, stress: FloatArray) -> int:
    """Return the place from which on stress stays above what it is in the beginning."""
    start = stress[:_FEWEST_FLAT]
    level = float(np.median(start)) + max(
        6 * noise_of(stress), 0.01 * float(np.ptp(stress)), 2 * float(np.ptp(start)) if len(start) else 0.0
    )
    below = np.flatnonzero(stress <= level)
    return min(int(below[-1]) + 1 if len(below) else 0, len(stress) - 1)


def _hinge(x: FloatArray, y: FloatArray, kink: float, toe: float) -> tuple[float, FloatArray]:
    """Fit a constant up to the kink and a cubic behind it, but for the toe; return mean square and coefficients."""
    kept = (x <= kink - toe) | (x >= kink + toe) if toe else np.ones(len(x), dtype=bool)
    behind = np.maximum(x[kept] - kink, 0.0)
    design = np.stack([np.ones_like(behind), behind, behind**2, behind**3], axis=1)
    if len(design) <= design.shape[1] + 1:
        return float("inf"), np.zeros(4)
    return _solved(design, y[kept])


def _solved(design: FloatArray, y: FloatArray) -> tuple[float, FloatArray]:
    """Return the mean square error, by degrees of freedom, and the coefficients."""
    values = np.asarray(np.linalg.lstsq(design, y)[0], dtype=np.float64)
    freedom = max(len(y) - design.shape[1], 1)
    return float(np.sum((design @ values - y) ** 2) / freedom), values


def _polynomial(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Fit a cubic; return its coefficients and their standard errors."""
    design = np.stack([np.ones_like(x), x, x**2, x**3], axis=1)
    cost, values = _solved(design, y)
    errors = np.sqrt(np.maximum(np.diag(np.linalg.pinv(design.T @ design)) * cost, 0.0))
    return values, errors


def _slope(x: FloatArray, y: FloatArray) -> float:
    """Return the slope of a straight line; 0 where all rows lie at one strain."""
    centred = x - x.mean() if len(x) else x
    spread = float(centred @ centred)
    return float(centred @ y) / spread if spread > 0 else 0.0


def _cubic(values: FloatArray, x: FloatArray) -> FloatArray:
    return np.asarray(values[1] * x + values[2] * x**2 + values[3] * x**3)


def _neo_hookean(strain: FloatArray, mode: Mode) -> FloatArray:
    stretch = 1 + strain if mode == "tension" else 1 - np.minimum(strain, 0.95)
    return np.asarray(np.abs(stretch - stretch**-2))
