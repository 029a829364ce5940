#!/usr/bin/env bash
# ezc3d 1.7.2 and c3d 0.6.0: a C3D of 70 000 frames comes back with 65 535, or with none
#
# Expected: a writer that takes 70 000 frames writes a file that readers can read; the C3D manual gives parameters
# (TRIAL:ACTUAL_END_FIELD, POINT:LONG_FRAMES) for more than the 65 535 of the 16-bit header.
# What happens: ezc3d writes all samples (the file has their size) but only 65535 as count, without those parameters
# and without a word. ezc3d reads 65 535 of them. The pure-Python reader c3d sees frames 1 to 65 535, but its loop
# ends at once: no frame at all, with a warning of numpy.
# Why it matters: seventy seconds of force at 1 kHz lose their end, or all.
# Instead: compute the number of frames from the size of the file, and cut trials before 65 535 frames.
#
# Seen:
#   written 70000 frames of 24 bytes, file 1681920 bytes; ezc3d reads 65535, c3d 0
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet ezc3d==1.7.2 c3d==0.6.0 numpy==2.4.6

venv/bin/python - <<'PYTHON'
import os
import warnings

import c3d
import ezc3d
import numpy as np

warnings.simplefilter("ignore")
FRAMES = 70_000
trial = ezc3d.c3d()
trial["parameters"]["POINT"]["RATE"]["value"] = [1000.0]
trial["parameters"]["POINT"]["LABELS"]["value"] = ["tip"]
trial["data"]["points"] = np.ones((4, 1, FRAMES))
trial["parameters"]["ANALOG"]["RATE"]["value"] = [1000.0]
trial["parameters"]["ANALOG"]["LABELS"]["value"] = ["Fx", "Fy"]
trial["data"]["analogs"] = np.zeros((1, 2, FRAMES))
trial.write("trial.c3d")
size = os.path.getsize("trial.c3d")
by_ezc3d = ezc3d.c3d("trial.c3d")["data"]["points"].shape[2]
with open("trial.c3d", "rb") as file:
    by_c3d = sum(1 for _ in c3d.Reader(file).read_frames())
print(f"written {FRAMES} frames of 24 bytes, file {size} bytes; ezc3d reads {by_ezc3d}, c3d {by_c3d}")
if (by_ezc3d, by_c3d) != (65_535, 0):
    raise SystemExit(f"changed: ezc3d reads {by_ezc3d} and c3d {by_c3d} frames")
PYTHON
