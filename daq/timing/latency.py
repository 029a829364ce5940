"""How much later one stream is stamped than another that follows the same motion.

Both signals belong to one motion and need no common unit: a coarse search correlates them over the lag, a fine one fits
the first signal, shifted, scaled, bent a little and with a linear drift, to the second one. The standard deviation is
that of the mean over five parts of the motion, each with a lag of its own and weighed by how much it tells of it, so
that it holds slow errors as well as noise.

The second signal has to follow the first without a lag of its own. A viscoelastic body does not: sway and tap on
something springy or hard, not on the tissue.

Compare the temporal calibration of the PLUS toolkit (Lasso et al., IEEE TBME 61(10), 2014), which correlates on a grid
of 1 ms.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from daq.errors import SynchronisationError
from robot_drivers.protocols import FloatArray

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

_PARTS = 5
_LAG_STEP_S = 1e-3
_MOST_STEPS = 100
_MOST_SAMPLES = 4000
_FEWEST_SAMPLES = 8 * _PARTS


@dataclass(frozen=True, slots=True)
class Latency:
    """A lag and the correlation that tells it.

    Attributes
    ----------
    lag_s, std_s : by how much the second signal is late, and the standard deviation of that
    lags_s, correlation, correlation_std : (k,) coefficient of correlation over the lag, without its sign; the
        standard deviation is that of the mean over the parts
    explained : share of the second signal's variance that the first one, shifted, explains
    """

    lag_s: float
    std_s: float
    lags_s: FloatArray
    correlation: FloatArray
    correlation_std: FloatArray
    explained: float


def main_motion(samples: FloatArray) -> FloatArray:
    """Return the coordinate (n,) along which samples (n, k) move most, from their mean; its sign is arbitrary."""
    centred = samples - samples.mean(axis=0)
    _, _, directions = np.linalg.svd(centred[:: max(1, len(centred) // _MOST_SAMPLES)], full_matrices=False)
    along: FloatArray = centred @ directions[0]
    return along


def estimate_latency(
    reference_time_s: FloatArray,
    reference: FloatArray,
    time_s: FloatArray,
    signal: FloatArray,
    largest_s: float = 0.2,
) -> Latency:
    """Find by how much ``signal`` is later than ``reference``.

    Parameters
    ----------
    reference_time_s, reference : (n,) ascending times of the better sampled, smoother signal
    time_s, signal : (m,) the other one
    largest_s : search among lags up to this, either way; for a periodic motion less than half a period

    Raises
    ------
    SynchronisationError
        The signals overlap by too little, or one of them does not move.
    """
    from scipy.interpolate import CubicSpline  # a recorder that starts need not wait for it

    ascending = np.concatenate([[True], np.diff(reference_time_s) > 0])
    curve = CubicSpline(reference_time_s[ascending], reference[ascending])
    begin, end = reference_time_s[0] + largest_s, reference_time_s[-1] - largest_s
    inside = (time_s >= begin) & (time_s <= end)
    times, values = _thinned(time_s[inside], signal[inside])
    if len(times) < _FEWEST_SAMPLES or np.ptp(values) == 0 or np.ptp(reference) == 0:
        raise SynchronisationError(
            f"latency: {len(times)} samples in which both streams move; {_FEWEST_SAMPLES} are needed; move for longer"
        )
    lags = np.arange(-largest_s, largest_s + _LAG_STEP_S / 2, _LAG_STEP_S)
    shifted = curve(times[:, None] - lags)
    parts = np.array_split(np.arange(len(times)), _PARTS)
    correlations = np.array([_correlation(shifted[part], values[part]) for part in parts])
    whole = _correlation(shifted, values)
    coarse = float(lags[whole.argmax()])
    lag = _refined(curve, times, values, coarse)
    fitted = _fitted(curve, times, values, lag)
    slope = (_fitted(curve, times, values, lag + _LAG_STEP_S) - fitted) / _LAG_STEP_S
    left = values - fitted
    by_part = np.array([_lag_that_remains(slope[part], left[part]) for part in parts])
    return Latency(
        lag_s=lag,
        std_s=_std_of_mean(*by_part.T),
        lags_s=lags,
        correlation=whole,
        correlation_std=correlations.std(axis=0, ddof=1) / np.sqrt(_PARTS),
        explained=1.0 - float(np.var(left) / np.var(values)),
    )


def _thinned(times: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Average neighbours where there are more samples than are needed."""
    group = max(1, len(times) // _MOST_SAMPLES)
    count = len(times) // group * group
    return times[:count].reshape(-1, group).mean(axis=1), values[:count].reshape(-1, group).mean(axis=1)


def _correlation(shifted: FloatArray, values: FloatArray) -> FloatArray:
    """Return the magnitude of the correlation of ``values`` (m,) with each column of ``shifted`` (m, k)."""
    columns = shifted - shifted.mean(axis=0)
    centred = values - values.mean()
    norms = np.linalg.norm(columns, axis=0) * np.linalg.norm(centred)
    return np.abs(centred @ columns) / np.maximum(norms, np.finfo(float).tiny)


def _refined(curve: "CubicSpline", times: FloatArray, values: FloatArray, coarse: float) -> float:
    """Return the lag that fits best near a coarse one."""
    from scipy.optimize import least_squares

    scale = float(np.std(values))

    def residuals(steps: FloatArray) -> FloatArray:
        return (_fitted(curve, times, values, coarse + _LAG_STEP_S * float(steps[0])) - values) / scale

    solution = least_squares(residuals, [0.0], loss="soft_l1", f_scale=0.1, max_nfev=_MOST_STEPS)
    return coarse + _LAG_STEP_S * float(solution.x[0])


def _fitted(curve: "CubicSpline", times: FloatArray, values: FloatArray, lag: float) -> FloatArray:
    """Return the first signal at a lag, scaled, bent and with a drift, such that it comes nearest to ``values``."""
    motion = curve(times - lag)
    motion = (motion - motion.mean()) / max(float(motion.std()), np.finfo(float).tiny)
    drift = (times - times.mean()) / max(float(np.ptp(times)), 1e-9)
    design = np.column_stack([motion, motion**2, motion**3, drift, np.ones_like(drift)])
    return np.asarray(design @ np.linalg.lstsq(design, values, rcond=None)[0], dtype=np.float64)


def _lag_that_remains(slope: FloatArray, left: FloatArray) -> tuple[float, float]:
    """Return the lag by which one part of the motion differs from the whole, to first order, and its weight."""
    centred = slope - slope.mean()
    weight = max(float(centred @ centred), np.finfo(float).tiny)
    return float(centred @ left) / weight, weight


def _std_of_mean(values: FloatArray, weights: FloatArray) -> float:
    """Return the standard deviation of the weighted mean of values whose variances are as one over their weights."""
    mean = np.average(values, weights=weights)
    return float(np.sqrt(np.average((values - mean) ** 2, weights=weights) / (len(values) - 1)))
