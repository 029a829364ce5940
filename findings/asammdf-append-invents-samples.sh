#!/usr/bin/env bash
# asammdf 8.8.28 (ASAM MDF 4): channels written together get samples that nobody measured
#
# Expected: `mdf.append([force, pose])` writes each signal with its own time stamps; MDF has a channel group for each
# rate. The docstring asks for nothing else, and says of `common_timebase` only that it must not be set when the time
# stamps differ (so it is not).
# What happens: all signals of one call are resampled to the union of their time stamps. Floating-point channels are
# interpolated, integer ones held, and outside its recording each keeps its first or last value. The file has no
# invalidation bits or other mark, so no reader can tell a sample from an invented one.
# Why it matters: a force at 100 Hz beside a pose at 1 kHz comes back at 1 kHz. Its mean seems known to 0.005 N instead
# of 0.014, its noise is no longer independent, and before its recording began the arm is said to have stood still.
# Instead: one `append` for each time base.
#
# Force at 100 Hz for 2 s (as raw counts, too), pose at 1 kHz from 0.5 s to 1.5 s.
#
# Seen:
#   one append
#     force  200 samples, 0.00 to 1.99 s; read 1120, 0.00 to 1.99 s, 0 marked invalid
#     counts 200 samples, 0.00 to 1.99 s; read 1120, 0.00 to 1.99 s, 0 marked invalid
#     pose   1000 samples, 0.50 to 1.50 s; read 1120, 0.00 to 1.99 s, 0 marked invalid
#     mean force 5.006 +- 0.005 N
#     pose stands still in 100 of 1119 steps
#   one append for each time base
#     force  200 samples, 0.00 to 1.99 s; read 200, 0.00 to 1.99 s, 0 marked invalid
#     counts 200 samples, 0.00 to 1.99 s; read 200, 0.00 to 1.99 s, 0 marked invalid
#     pose   1000 samples, 0.50 to 1.50 s; read 1000, 0.50 to 1.50 s, 0 marked invalid
#     mean force 5.003 +- 0.014 N
#     pose stands still in 0 of 999 steps
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet asammdf==8.8.28 numpy==2.4.6

venv/bin/python - <<'PYTHON'
import numpy as np
from asammdf import MDF, Signal

rng = np.random.default_rng(0)
force_times, pose_times = np.arange(200) / 100, 0.5 + np.arange(1000) / 1000
force = 5 + rng.normal(scale=0.2, size=force_times.size)
written = [
    Signal(force, force_times, name="force", unit="N"),
    Signal((force * 1000).astype("<i4"), force_times, name="counts"),
    Signal(0.04 * (pose_times - 0.5), pose_times, name="pose", unit="m"),
]


def read(appends):
    """Write with one append for each list of signals; read the file again."""
    with MDF(version="4.10") as mdf:
        for signals in appends:
            mdf.append(signals)
        mdf.save("trial.mf4", overwrite=True)
    with MDF("trial.mf4") as mdf:
        return {signal.name: mdf.get(signal.name) for signal in written}


def told(case, signals):
    print(case)
    for signal in written:
        found = signals[signal.name]
        marked = 0 if found.invalidation_bits is None else int(np.sum(found.invalidation_bits))
        print(
            f"  {signal.name:6s} {len(signal)} samples, {signal.timestamps[0]:.2f} to {signal.timestamps[-1]:.2f} s;"
            f" read {len(found)}, {found.timestamps[0]:.2f} to {found.timestamps[-1]:.2f} s, {marked} marked invalid"
        )
    found = signals["force"].samples
    print(f"  mean force {found.mean():.3f} +- {found.std(ddof=1) / np.sqrt(found.size):.3f} N")
    pose = signals["pose"]
    still = np.sum(np.diff(pose.samples) == 0)
    print(f"  pose stands still in {still} of {len(pose) - 1} steps")


together, apart = read([written]), read([written[:2], written[2:]])
told("one append", together)
told("one append for each time base", apart)
if any(len(apart[signal.name]) != len(signal) for signal in written):
    raise SystemExit("changed: signals written apart do not come back as they were")
if all(len(together[signal.name]) == len(signal) for signal in written):
    raise SystemExit("changed: signals written together keep their own time stamps")
if any(signal.invalidation_bits is not None for signal in together.values()):
    raise SystemExit("changed: invented samples are marked")
PYTHON
