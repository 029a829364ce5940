#!/usr/bin/env bash
# pyuff 2.5.8 (universal file, data set 58): time to six digits, lost samples become 0 N
#
# Expected: double-precision data keep their times, and a missing sample (NaN) stays missing or is refused.
# What happens: the format writes first time and step as E13.5, also for binary and for double data, so 1/6000 s
# becomes 1.66667e-04 s and ten minutes end 1.2 ms late, seven samples. Times of uneven text data are rounded the
# same way: to 0.5 ms after 100 s, so samples of a 6 kHz record share times. And the writer turns NaN into 0, in the
# caller's dictionary as well.
# Documented: the formats are in the docstring ("3E13.5"); the NaN is not.
# Why it matters: force against picture or robot drifts over a long trial; zeros of a contact force look real.
# Instead: keep the rate yourself (round to the nearest whole Hz after reading), split long records, and mark gaps
# apart.
#
# Seen:
#   step 0.000166667 s for 1/6000 s; last of 3600000 samples +1.20 ms
#   uneven times after 500 s: 101 different ones for 600 samples
#   written [2.  2.1 nan 2.2], read [2.  2.1 0.  2.2], the caller's own now [2.  2.1 0.  2.2]
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet pyuff==2.5.8 numpy==2.4.6

venv/bin/python - <<'PYTHON'
import numpy as np
import pyuff


def data_set(time_s, force_n, binary, even=1):
    return {
        "type": 58, "binary": binary, "func_type": 1, "id1": "Fz", "id4": "N", "id5": "s",
        "rsp_ent_name": "tip", "rsp_node": 1, "rsp_dir": 3, "ref_ent_name": "base", "ref_node": 1, "ref_dir": 3,
        "x": time_s, "data": force_n, "abscissa_spacing": even, "orddenom_spec_data_type": 0,
    }


def written_and_read(file, data):
    pyuff.UFF(file).write_sets(data, "add")
    return pyuff.UFF(file).read_sets()


time_s = np.arange(600 * 6000) / 6000.0
read = written_and_read("even.uff", data_set(time_s, np.zeros(len(time_s)), binary=1))
late = read["x"][-1] - time_s[-1]
print(f"step {read['abscissa_inc']:.9f} s for 1/6000 s; last of {len(read['x'])} samples {late * 1e3:+.2f} ms")

uneven_s = 500 + np.arange(600) / 6000.0
read = written_and_read("uneven.uff", data_set(uneven_s, np.zeros(600), binary=0, even=0))
distinct = len(np.unique(read["x"]))
print(f"uneven times after 500 s: {distinct} different ones for 600 samples")

force_n = np.array([2.0, 2.1, np.nan, 2.2])
given = data_set(np.arange(4) / 6000.0, force_n, binary=0)
read = written_and_read("gap.uff", given)
print(f"written {force_n}, read {read['data']}, the caller's own now {given['data']}")
if abs(late - 1.2e-3) > 1e-4 or distinct > 300 or read["data"][2] != 0:
    raise SystemExit("changed: times or missing samples are kept")
PYTHON
