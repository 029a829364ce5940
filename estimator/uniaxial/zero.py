"""Where strain and stress begin: slack that the machine takes up first, and load that the specimen bears already.

Slack is the strain up to which rows bear no load, though the test moves: the zero of strain lies at its end (toe
compensation, as in ASTM D638, annex A1). It is found as the kink of a curve that is flat before and a cubic behind.
Stress at zero strain is either a preload, so that the specimen is stretched already, or an offset of the load cell; a
Neo-Hookean curve tells which. A curve that merely begins softly is left as it is: that may be the material.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial

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
_TOE_STEP = 0.005
_MISSED = 6.0  # mean square over a soft beginning, over what noise alone would make of it
_STEEP = 0.75  # slope there, over the one up to the end
_SOFT = 0.5  # slope of a beginning that is being taken up, over the one right behind it
_LONGEST_TOE = 0.12  # of the range of strain; a longer one may be the material
_MOST_BEARABLE = 0.1  # of the stress that a strain from the file's zero would have made
_FAR_FROM_ZERO = 0.02  # of the range of strain


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
    return _flat_beginning(strain, stress) or _soft_beginning(strain, stress)


def find_start(strain: FloatArray, stress: FloatArray) -> float | None:
    """Return the strain at which a record begins without load though far from zero, as travel does; None otherwise.

    Parameters
    ----------
    strain, stress : (n,) magnitudes of the first loading, without slack
    """
    start, reach = float(strain[0]), float(np.ptp(strain))
    used = strain <= start + min(_FARTHEST, reach / 2)
    if abs(start) <= _FAR_FROM_ZERO * reach or used.sum() < 2 * _BEGINNING:
        return None
    values, errors = _polynomial(strain[used] - start, stress[used])
    borne = abs(float(values[0])) - _SURE * float(errors[0])
    if values[1] <= 0 or borne > _MOST_BEARABLE * values[1] * abs(start):
        return None
    return start


def _flat_beginning(strain: FloatArray, stress: FloatArray) -> Slack | None:
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
    if flat < _FEWEST_FLAT or kink - min(begin, 0.0) < _LEAST_SLACK:
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


def _soft_beginning(strain: FloatArray, stress: FloatArray) -> Slack | None:
    """Find a bend at the very beginning, behind which the curve is a cubic that is steepest there.

    A material that begins softly goes on to stiffen; what is soft over some hundredths of strain only, and no longer
    behind them, is a specimen that straightens or faces that come to bear.
    """
    begin, reach = float(strain.min()), float(strain.max())
    level = float(np.median(stress[:_FEWEST_FLAT]))
    end = begin + min(_FARTHEST, (reach - begin) / 2)
    x, y = strain[strain <= end] - begin, stress[strain <= end] - level
    if len(x) < 4 * _BEGINNING or abs(level) > max(
        _LEAST_STRESS * float(np.ptp(stress)), 4 * noise_of(stress)
    ):
        return None
    allowed = max(1.5 * noise_of(stress), _NEGLIGIBLE / 2 * float(np.ptp(stress)))
    for toe in np.arange(_TOE_STEP, _LONGEST_TOE * (reach - begin), _TOE_STEP):
        if len(np.unique(x[x >= toe])) < 4 * _BEGINNING:
            return None
        kink = _kink_of_bend(x, y, float(toe), allowed)
        if kink is not None:
            return Slack(begin + kink, level, float(toe) - kink)
    return None


def _kink_of_bend(x: FloatArray, y: FloatArray, toe: float, allowed: float) -> float | None:
    """Return where the cubic through all rows behind a toe has its zero, if those before it begin much more softly.

    Parameters
    ----------
    x, y : (n,) strain from the first on, and stress
    allowed : root mean square error of the cubic
    """
    behind = x >= toe
    course = Polynomial.fit(x[behind], y[behind], 3)
    cost = float(np.sum((course(x[behind]) - y[behind]) ** 2)) / (int(behind.sum()) - 4)
    roots = np.asarray(course.roots(), dtype=np.complex128)
    kink = float(roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real < toe)].max(initial=0.0))
    # a bend reaches behind its kink as far as half of what lies before
    if cost > allowed**2 or not _LEAST_SLACK <= kink <= toe / 1.5:
        return None
    before = x <= kink
    # rows at few strains, as in a staircase, do not tell where between them load began
    widest = float(np.diff(np.sort(x[x < toe]), prepend=0.0, append=toe).max())
    if before.sum() < _FEWEST_FLAT or widest > kink / 2:
        return None
    slope, chord = float(course.deriv()(kink)), float(course(x.max())) / (float(x.max()) - kink)
    error = float(np.sqrt(cost) / np.linalg.norm(x[before] - x[before].mean()))
    missed = float(np.mean((course(x[x < toe]) - y[x < toe]) ** 2))
    # what noise alone makes of a cubic that is followed back over the toe
    powers = (x[:, None] / x.max()) ** np.arange(4)
    spread = np.linalg.pinv(powers[behind].T @ powers[behind])
    expected = cost * (1 + float(np.mean(np.sum(powers[~behind] @ spread * powers[~behind], axis=1))))
    soft = _slope(x[before], y[before]) - error < _SOFT * slope
    return kink if soft and missed >= _MISSED * expected and slope >= _STEEP * chord else None


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
