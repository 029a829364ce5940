#!/usr/bin/env bash
# methcomp 1.0.0: lines of Deming and of Passing and Bablok with other slopes than these methods have
#
# Expected: `deming` and `passingbablok` draw the lines of those methods; points that lie on a line give that line.
# What happens:
#   - `deming` has the variance of y where the formula has the covariance. Points exactly on y = 2 x get slope 1.44, on
#     y = x / 2 slope 0.30, and a falling line is drawn rising. A slope of 1 comes out right, and near it the error is
#     small, so that nothing is noticed as long as two instruments agree;
#   - `passingbablok`, when the number of pairs of points is odd (22 or 30 points have 231 and 435), takes not the
#     middle one of the sorted slopes but one far from it.
# Documented: as the methods, with their references. Nothing warns.
# Why it matters: both are the usual answer to "does the new force sensor agree with the testing machine, when both
# err"; a wrong factor of calibration is what they should show.
# Instead: `odrpack` with equal weights for Deming's line; the shifted median of slopes in two lines of numpy.
#
# Readings of machine (x) and sensor (y): on a line without noise, and about y = x with noise of 0.05.
#
# Seen:
#   points on y =  2.00 x + 0.3: deming draws slope +1.44
#   points on y =  1.10 x + 0.3: deming draws slope +1.09
#   points on y =  1.00 x + 0.3: deming draws slope +1.00
#   points on y =  0.50 x + 0.3: deming draws slope +0.30
#   points on y = -1.00 x + 0.3: deming draws slope +1.00
#   12 points, 66 pairs: passingbablok draws 0.99, by hand 0.98
#   22 points, 231 pairs: passingbablok draws 0.67, by hand 1.02
#   30 points, 435 pairs: passingbablok draws 0.60, by hand 1.04
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet methcomp==1.0.0 matplotlib==3.11.2 pandas==3.1.1 shapely==2.2.0 statsmodels==0.15.0 \
    scipy==1.17.1 numpy==2.4.6

venv/bin/python - <<'PYTHON'
import matplotlib

matplotlib.use("Agg")
import numpy as np
from matplotlib import pyplot
from methcomp.regression import deming, passingbablok


def drawn_slope(method, machine_n, sensor_n, **settings):
    """Slope of the line whose equation is in the legend."""
    axes = method(machine_n, sensor_n, ax=pyplot.figure().add_subplot(), line_reference=False, **settings)
    (line,) = (line for line in axes.lines if "Method 1" in line.get_label())
    x, y = line.get_data()
    return float((y[1] - y[0]) / (x[1] - x[0]))


def passing_bablok_slope(machine_n, sensor_n):
    """Median of the slopes between pairs, shifted by the number of slopes below -1 (Passing and Bablok 1983)."""
    first, second = np.triu_indices(len(machine_n), 1)
    slopes = np.sort((sensor_n[second] - sensor_n[first]) / (machine_n[second] - machine_n[first]))
    return float(np.median(slopes[2 * np.sum(slopes < -1) :]))


machine_n = np.arange(1.0, 11.0)
drawn = {}
for slope in (2.0, 1.1, 1.0, 0.5, -1.0):
    drawn[slope] = drawn_slope(deming, machine_n, slope * machine_n + 0.3, vr=1.0, bootstrap=None)
    print(f"points on y = {slope:5.2f} x + 0.3: deming draws slope {drawn[slope]:+.2f}")

error = {}
for count in (12, 22, 30):
    generator = np.random.default_rng(count)
    machine_n = np.sort(generator.uniform(0, 1, count))
    sensor_n = machine_n + generator.normal(0, 0.05, count)
    got, right = drawn_slope(passingbablok, machine_n, sensor_n), passing_bablok_slope(machine_n, sensor_n)
    error[count] = abs(got - right)
    print(f"{count} points, {count * (count - 1) // 2} pairs: passingbablok draws {got:.2f}, by hand {right:.2f}")

if np.isclose(drawn[2.0], 2.0) or np.isclose(drawn[-1.0], -1.0):
    raise SystemExit("changed: Deming's line goes through points on a line")
if not (np.isclose(drawn[1.0], 1.0) and np.isclose(drawn[-1.0], 1.0)):
    raise SystemExit(f"changed: Deming's slopes are {drawn}")
if error[12] > 0.05 or min(error[22], error[30]) < 0.2:
    raise SystemExit("changed: the slope of Passing and Bablok is right for odd numbers of pairs")
PYTHON
