#!/usr/bin/env bash
# statsmodels 0.15.0: limits of agreement (Bland and Altman) with the wrong standard deviation
#
# Expected: `mean_diff_plot` draws mean +- 1.96 s, with s the sample standard deviation of the differences (n - 1),
# as Bland and Altman 1986 and its own notes ("the standard deviation of the differences") say.
# What happens: it divides by n. With six specimens the limits are 9 % too narrow, with four 13 %.
# Why it matters: agreement of a new force sensor with the testing machine, shown on few specimens, looks better
# than it is.
# Instead: compute the limits (`numpy.std(ddof=1)`) and, with few specimens, their confidence interval.
#
# Seen:
#   half width drawn 0.1201 N; with n - 1 0.1316 N, with n 0.1201 N
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet statsmodels==0.15.0 matplotlib==3.11.2 scipy==1.17.1 numpy==2.4.6

venv/bin/python - <<'PYTHON'
import matplotlib

matplotlib.use("Agg")
import numpy as np
from statsmodels.graphics.api import mean_diff_plot

sensor_n = np.array([1.02, 2.05, 2.96, 4.10, 4.93, 6.08])
machine_n = np.array([1.00, 2.00, 3.00, 4.00, 5.00, 6.00])
difference = sensor_n - machine_n
axes = mean_diff_plot(sensor_n, machine_n, sd_limit=1.96).axes[0]
drawn = max(float(line.get_ydata()[0]) for line in axes.lines) - difference.mean()
by_n_1, by_n = 1.96 * difference.std(ddof=1), 1.96 * difference.std(ddof=0)
print(f"half width drawn {drawn:.4f} N; with n - 1 {by_n_1:.4f} N, with n {by_n:.4f} N")
if not np.isclose(drawn, by_n) or np.isclose(drawn, by_n_1):
    raise SystemExit("changed: the limits are no longer drawn with n")
PYTHON
