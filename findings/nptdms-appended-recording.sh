#!/usr/bin/env bash
# npTDMS 1.13.0: a recording that was continued gets the start time of its last part
#
# Expected: `time_track(absolute_time=True)` of a channel that was recorded in two parts, the second
# appended to the .tdms by `TdmsWriter(mode="a")`, dates each part by the wf_start_time in its own segment; or it
# refuses.
# What happens: of the segments' properties only the last are kept, and one even row of times is laid over all samples
# from there. With a pause of a minute the first part is dated 60 s late, the pause is gone and the second part 1 s
# late. No warning; the first start time cannot be had from the channel.
# Why it matters: force against pictures and robot by absolute time, after a trial was stopped and continued.
# Instead: a file or a channel for each part, or a channel of times.
#
# Seen:
#   part 1: recorded from 2026-01-01T12:00:00, dated from 2026-01-01T12:01:00.000000000 (+60.00 s)
#   part 2: recorded from 2026-01-01T12:01:00, dated from 2026-01-01T12:01:01.000000000 (+1.00 s)
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet nptdms==1.13.0 numpy==2.4.6

venv/bin/python - <<'PYTHON'
import numpy as np
from nptdms import ChannelObject, TdmsFile, TdmsWriter

RATE_HZ, SAMPLES = 100, 100
STARTS = [np.datetime64("2026-01-01T12:00:00"), np.datetime64("2026-01-01T12:01:00")]

for start, mode in zip(STARTS, "wa", strict=True):
    properties = {"wf_start_time": start, "wf_start_offset": 0.0, "wf_increment": 1 / RATE_HZ}
    with TdmsWriter("trial.tdms", mode=mode) as file:
        file.write_segment([ChannelObject("trial", "Fz", np.zeros(SAMPLES), properties=properties)])

times = TdmsFile.read("trial.tdms")["trial"]["Fz"].time_track(absolute_time=True)
late_s = [float((times[part * SAMPLES] - start) / np.timedelta64(1, "s")) for part, start in enumerate(STARTS)]
for part, start in enumerate(STARTS):
    print(f"part {part + 1}: recorded from {start}, dated from {times[part * SAMPLES]} ({late_s[part]:+.2f} s)")
if not np.allclose(late_s, [60, 1]):
    raise SystemExit("changed: the parts are dated otherwise")
PYTHON
