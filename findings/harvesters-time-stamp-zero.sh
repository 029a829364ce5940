#!/usr/bin/env bash
# Harvesters 1.4.3 with genicam 1.6.0: frames without a time stamp are said to be of time 0
#
# Expected: where a GenTL producer delivers no time stamps, `buffer.timestamp` says so, as `buffer.timestamp_ns` does:
# it raises NotAvailableException.
# What happens: `buffer.timestamp`, of which the documentation says no more than that its unit is the producer's, catches
# the producer's error and is 0 for every frame.
# Why it matters: a recorder that stamps images so has them all at one moment, and a rate or a clock model fitted to
# them divides by nothing. The simulated cameras in the wheel of genicam itself are such, so that a program tried
# on them looks right until it needs the times.
# Instead: read `timestamp_ns`, and refuse a camera that has none.
#
# Seen:
#   8 frames in 0.40 s: timestamp [0]; timestamp_ns raises NotAvailableException
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet harvesters==1.4.3 genicam==1.6.0

venv/bin/python - <<'PYTHON'
import time
from pathlib import Path

import genicam
from genicam.gentl import NotAvailableException
from harvesters.core import Harvester

harvester = Harvester()
harvester.add_file(str(Path(genicam.__file__).parent / "viky.cti"))
harvester.update()
camera = harvester.create(0)
camera.start()
began, stamps, raised = time.monotonic(), set(), 0
for _ in range(8):
    with camera.fetch(timeout=5) as buffer:
        stamps.add(buffer.timestamp)
        try:
            buffer.timestamp_ns
        except NotAvailableException:
            raised += 1
took = time.monotonic() - began
camera.stop()
camera.destroy()
harvester.reset()
print(
    f"8 frames in {took:.2f} s: timestamp {sorted(stamps)}; "
    f"timestamp_ns {'raises NotAvailableException' if raised == 8 else 'is known'}"
)
if took < 0.1 or stamps != {0} or raised != 8:
    raise SystemExit("changed: frames have times, or it is said that they have none")
PYTHON
